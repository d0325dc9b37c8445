// Charts of measured curves as SVG: both axes logarithmic, one line per series.
#pragma once

#include <string>
#include <vector>

namespace lumel {

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;
  std::string label{};  // written below the point, on its left: clear of a falling curve; may be empty
};

struct PlotSeries {
  std::string name;               // in the legend
  std::vector<PlotPoint> points;  // joined in this order; points that are not positive and finite are left out
};

/// A level that the curves are judged by, drawn across the whole plot.
struct PlotLevel {
  std::string name;
  double y = 0.0;
};

struct Plot {
  std::string title;
  std::string xLabel;
  std::string yLabel;
  std::vector<PlotSeries> series;
  std::vector<PlotLevel> levels{};
};

/// The whole SVG file. Axes span the points, rounded outwards to 1, 2 or 5 times a power of ten; the legend stands
/// beside the plot, where no curve runs. Without a point that can be shown there are axes and a note.
std::string plotSvg(const Plot& plot);

}  // namespace lumel
