#include "baker/study/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace lumel {
namespace {

constexpr double kWidth = 860.0;
constexpr double kHeight = 520.0;
constexpr double kLeft = 78.0;
constexpr double kRight = 230.0;  // the legend's column
constexpr double kTop = 48.0;
constexpr double kBottom = 62.0;
constexpr double kLegendStep = 22.0;
// Told apart with any kind of colour vision (Okabe and Ito 2008), and by the marks.
constexpr std::array<const char*, 7> kColors = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                "#e69f00", "#56b4e9", "#000000"};

std::string number(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", v);
  return text;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  }
  return out;
}

bool shown(const PlotPoint& p) { return std::isfinite(p.x) && std::isfinite(p.y) && p.x > 0.0 && p.y > 0.0; }

/// A logarithmic axis from `least` to `most`, both 1, 2 or 5 times a power of ten.
struct Axis {
  double least = 1.0;
  double most = 10.0;

  static double step(double v, bool up) {
    const double decade = std::pow(10.0, std::floor(std::log10(v) + 1e-9));
    constexpr std::array<double, 4> kSteps = {1.0, 2.0, 5.0, 10.0};
    if (up) {
      for (const double s : kSteps)
        if (s * decade >= v * (1 - 1e-9)) return s * decade;
      return 10.0 * decade;
    }
    double best = decade;
    for (const double s : kSteps)
      if (s * decade <= v * (1 + 1e-9)) best = s * decade;
    return best;
  }
  static Axis around(double low, double high) {
    Axis axis{step(low / 1.08, false), step(high * 1.08, true)};
    if (axis.most < 4.0 * axis.least) axis = {step(axis.least / 2.0, false), step(axis.most * 2.0, true)};
    return axis;
  }
  /// 0..1 along the axis.
  double at(double v) const { return std::log(v / least) / std::log(most / least); }
  /// The values that get a line, and whether they get a number too: as many as can be read.
  std::vector<std::pair<double, bool>> ticks() const {
    const double decades = std::log10(most / least);
    std::vector<std::pair<double, bool>> all;
    for (int e = static_cast<int>(std::floor(std::log10(least) + 1e-9)); std::pow(10.0, e) <= most * 1.0001; ++e)
      for (const int m : {1, 2, 5}) {
        const double v = m * std::pow(10.0, e);
        if (v < least * 0.9999 || v > most * 1.0001) continue;
        all.emplace_back(v, m == 1 ? decades < 9.0 || e % 2 == 0 : decades < 3.6);
      }
    return all;
  }
};

std::string tickText(double v) {
  constexpr std::array<std::pair<double, const char*>, 3> kUnits = {{{1e9, "G"}, {1e6, "M"}, {1e3, "k"}}};
  char text[32];
  for (const auto& [unit, suffix] : kUnits)
    if (v >= unit * 0.9999) {
      std::snprintf(text, sizeof text, "%.4g%s", v / unit, suffix);
      return text;
    }
  std::snprintf(text, sizeof text, "%.4g", v);
  return text;
}

class Drawing {
 public:
  explicit Drawing(const Plot& plot) : plot_(plot) {
    double lowX = HUGE_VAL, highX = 0.0, lowY = HUGE_VAL, highY = 0.0;
    for (const PlotSeries& series : plot.series)
      for (const PlotPoint& p : series.points) {
        if (!shown(p)) continue;
        lowX = std::min(lowX, p.x), highX = std::max(highX, p.x);
        lowY = std::min(lowY, p.y), highY = std::max(highY, p.y);
      }
    if (!(highX > 0.0)) return;
    any_ = true;
    for (const PlotLevel& level : plot.levels)
      if (level.y > lowY / 4.0 && level.y < highY * 4.0)
        lowY = std::min(lowY, level.y), highY = std::max(highY, level.y);
    x_ = Axis::around(lowX, highX);
    y_ = Axis::around(lowY, highY);
  }

  std::string svg() {
    out_ = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + number(kWidth) + " " + number(kHeight) +
           "\" width=\"" + number(kWidth) + "\" height=\"" + number(kHeight) +
           "\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
    text(kLeft, 28, plot_.title, "start", "font-size=\"16\" font-weight=\"bold\"");
    drawAxes();
    drawLevels();
    for (std::size_t i = 0; i < plot_.series.size(); ++i) drawSeries(i);
    drawLegend();
    return out_ + "</svg>\n";
  }

 private:
  double px(double v) const { return kLeft + x_.at(v) * (kWidth - kLeft - kRight); }
  double py(double v) const { return kHeight - kBottom - y_.at(v) * (kHeight - kTop - kBottom); }

  void text(double x, double y, const std::string& words, const char* anchor, const std::string& more = "") {
    out_ += "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" text-anchor=\"" + anchor + "\" " + more + ">" +
            escaped(words) + "</text>\n";
  }
  void line(double x0, double y0, double x1, double y1, const std::string& style) {
    out_ += "<line x1=\"" + number(x0) + "\" y1=\"" + number(y0) + "\" x2=\"" + number(x1) + "\" y2=\"" + number(y1) +
            "\" " + style + "/>\n";
  }

  void drawAxes() {
    const double bottom = kHeight - kBottom;
    const double right = kWidth - kRight;
    for (const auto& [v, named] : x_.ticks()) {
      line(px(v), kTop, px(v), bottom, named ? "stroke=\"#d0d0d0\"" : "stroke=\"#ececec\"");
      if (named) text(px(v), bottom + 18, tickText(v), "middle");
    }
    for (const auto& [v, named] : y_.ticks()) {
      line(kLeft, py(v), right, py(v), named ? "stroke=\"#d0d0d0\"" : "stroke=\"#ececec\"");
      if (named) text(kLeft - 8, py(v) + 4.5, tickText(v), "end");
    }
    out_ += "<rect x=\"" + number(kLeft) + "\" y=\"" + number(kTop) + "\" width=\"" + number(right - kLeft) +
            "\" height=\"" + number(bottom - kTop) + "\" fill=\"none\" stroke=\"#404040\"/>\n";
    text((kLeft + right) / 2, bottom + 44, plot_.xLabel, "middle");
    const double middle = (kTop + bottom) / 2;
    text(20, middle, plot_.yLabel, "middle", "transform=\"rotate(-90 20 " + number(middle) + ")\"");
    if (!any_) text((kLeft + right) / 2, middle, "no point to show", "middle", "fill=\"#808080\"");
  }

  void drawLevels() {
    if (!any_) return;
    for (const PlotLevel& level : plot_.levels)
      if (level.y >= y_.least && level.y <= y_.most)
        line(kLeft, py(level.y), kWidth - kRight, py(level.y), "stroke=\"#606060\" stroke-dasharray=\"6 4\"");
  }

  void mark(double x, double y, std::size_t series) {
    const std::string color = kColors[series % kColors.size()];
    const double r = 4.2;
    switch (series % 4) {
      case 0:
        out_ += "<circle cx=\"" + number(x) + "\" cy=\"" + number(y) + "\" r=\"" + number(r) + "\" fill=\"" + color +
                "\"/>\n";
        break;
      case 1:
        out_ += "<rect x=\"" + number(x - r) + "\" y=\"" + number(y - r) + "\" width=\"" + number(2 * r) +
                "\" height=\"" + number(2 * r) + "\" fill=\"" + color + "\"/>\n";
        break;
      default: {
        const double up = series % 4 == 2 ? -1.0 : 1.0;
        out_ += "<polygon points=\"" + number(x - 5) + "," + number(y - up * 4) + " " + number(x + 5) + "," +
                number(y - up * 4) + " " + number(x) + "," + number(y + up * 5) + "\" fill=\"" + color + "\"/>\n";
      }
    }
  }

  void drawSeries(std::size_t index) {
    std::string path;
    for (const PlotPoint& p : plot_.series[index].points)
      if (shown(p)) path += (path.empty() ? "M" : " L") + number(px(p.x)) + " " + number(py(p.y));
    if (path.empty()) return;
    out_ += "<path d=\"" + path + "\" fill=\"none\" stroke-width=\"1.8\" stroke=\"" + kColors[index % kColors.size()] +
            "\"/>\n";
    for (const PlotPoint& p : plot_.series[index].points) {
      if (!shown(p)) continue;
      mark(px(p.x), py(p.y), index);
      if (!p.label.empty())
        text(px(p.x) - 5, py(p.y) + 16, p.label, "end",
             "font-size=\"11\" stroke=\"white\" stroke-width=\"3\" paint-order=\"stroke\" fill=\"" +
                 std::string(kColors[index % kColors.size()]) + "\"");
    }
  }

  void drawLegend() {
    const double x = kWidth - kRight + 16;
    double y = kTop + 12;
    for (std::size_t i = 0; i < plot_.series.size(); ++i, y += kLegendStep) {
      line(x, y - 4, x + 26, y - 4, "stroke-width=\"1.8\" stroke=\"" + std::string(kColors[i % kColors.size()]) + "\"");
      mark(x + 13, y - 4, i);
      text(x + 34, y, plot_.series[i].name, "start");
    }
    for (const PlotLevel& level : plot_.levels) {
      line(x, y - 4, x + 26, y - 4, "stroke=\"#606060\" stroke-dasharray=\"6 4\"");
      text(x + 34, y, level.name, "start");
      y += kLegendStep;
    }
  }

  const Plot& plot_;
  Axis x_;
  Axis y_;
  bool any_ = false;
  std::string out_;
};

}  // namespace

std::string plotSvg(const Plot& plot) { return Drawing(plot).svg(); }

}  // namespace lumel
