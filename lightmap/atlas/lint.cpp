#include "lightmap/atlas/lint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <tuple>

#include "lightmap/atlas/bake_frame.h"
#include "lightmap/atlas/uv_points.h"
#include "lightmap/raster.h"
#include "lightmap/texels/texels.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr double kDensityTolerance = 0.25;
constexpr double kFarTexels = 4.0;              // a slit of less blurs a detail that a lightmap does not hold
constexpr double kFloatUvStep = 6e-8;           // of the page's side
constexpr double kBytesPerTexel = 4 * 3 * 2.0;  // four maps of three half floats

struct ChartFigures {
  double surface = 0, texels = 0, signedTexels = 0;
  double overlap = 0;
  std::size_t flipped = 0;
  bool crossesFrame = false, near = false;
  int surfaceIndex = -1;
  Vec2d place{0.0};  // a corner, in texels
};

using Corners = std::array<Vec2d, 3>;

Corners texelCorners(const Atlas& atlas, const Surface& surface, std::size_t triangle) {
  const Page& page = atlas.pages[static_cast<std::size_t>(surface.page)];
  Corners p;
  for (std::size_t k = 0; k < 3; ++k)
    p[k] = Vec2d(surface.lightmapUvs[surface.indices[3 * triangle + k]]) * Vec2d(page.width, page.height);
  return p;
}

/// Positive where the triangle is counter-clockwise as seen: rows run down.
double seenArea(const Corners& p) { return -signedArea(p[0], p[1], p[2]); }

double worldArea(const Surface& surface, std::size_t triangle) {
  const std::uint32_t* v = &surface.indices[3 * triangle];
  return triangleArea(Vec3d(surface.positions[v[0]]), surface.positions[v[1]], surface.positions[v[2]]);
}

class Linter {
 public:
  Linter(const Scene& scene, const Atlas& atlas, int padding)
      : scene_(scene), atlas_(atlas), padding_(padding), charts_(atlas.charts.size()) {}

  LintReport run() {
    report_.charts = atlas_.charts.size();
    report_.pages = atlas_.pages.size();
    measureTriangles();
    for (std::size_t page = 0; page < atlas_.pages.size(); ++page) measurePage(static_cast<int>(page));
    findFrameCrossings();
    addChartFindings();
    findMixedTexels();
    report_.mapBytes = report_.pageTexels * kBytesPerTexel;
    return std::move(report_);
  }

 private:
  std::string nameOf(int surface) const {
    if (surface < 0) return {};
    const Surface& s = atlas_.surfaces[static_cast<std::size_t>(surface)];
    return scene_.instances[static_cast<std::size_t>(s.instance)].name + ", primitive " + std::to_string(s.primitive);
  }

  void setWorst(LintFinding& finding, double value, int surface, Vec2d place) const {
    if (finding.worst.empty() || value > finding.worstValue) {
      finding.worst = nameOf(surface);
      finding.worstValue = value;
      finding.page = atlas_.surfaces[static_cast<std::size_t>(surface)].page;
      finding.x = static_cast<int>(std::clamp(place.x, -1e6, 1e6));
      finding.y = static_cast<int>(std::clamp(place.y, -1e6, 1e6));
    }
  }

  void measureTriangles() {
    LintFinding outside{.id = "out-of-range",
                        .meaning = "vertices with lightmap UVs outside 0..1 or not finite",
                        .level = LintLevel::Error,
                        .unit = "vertices"};
    LintFinding lost{.id = "lost",
                     .meaning = "triangles with a surface whose lightmap UVs have no area",
                     .level = LintLevel::Warning,
                     .unit = "triangles"};
    for (std::size_t s = 0; s < atlas_.surfaces.size(); ++s) {
      const Surface& surface = atlas_.surfaces[s];
      const Page& page = atlas_.pages[static_cast<std::size_t>(surface.page)];
      outside.total += static_cast<double>(surface.lightmapUvs.size());
      lost.total += static_cast<double>(surface.triangleCount());
      for (const Vec2& uv : surface.lightmapUvs) {
        if (uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1) continue;
        ++outside.count;
        const double off = std::max({-uv.x, uv.x - 1, -uv.y, uv.y - 1});
        setWorst(outside, std::isfinite(off) ? off : 1e9, static_cast<int>(s),
                 Vec2d(uv) * Vec2d(page.width, page.height));
      }
      for (std::size_t t = 0; t < surface.triangleCount(); ++t) {
        const Corners p = texelCorners(atlas_, surface, t);
        const double area = worldArea(surface, t);
        const double texels = seenArea(p);
        ChartFigures& chart = charts_[surface.charts[t]];
        if (chart.surfaceIndex < 0) {
          chart.surfaceIndex = static_cast<int>(s);
          chart.place = p[0];
        }
        chart.surface += area;
        if (!std::isfinite(texels)) continue;
        chart.texels += std::abs(texels);
        chart.signedTexels += texels;
        if (texels == 0 && area > 0) {
          ++lost.count;
          setWorst(lost, area, static_cast<int>(s), p[0]);
        }
      }
    }
    report_.findings.push_back(outside);
    report_.findings.push_back(lost);
    addFlips();
  }

  /// A triangle that turns against most of its chart; a chart that turns as a whole is mirrored.
  void addFlips() {
    LintFinding flips{.id = "flip",
                      .meaning = "triangles turned over within their chart",
                      .level = LintLevel::Error,
                      .unit = "triangles"};
    for (std::size_t s = 0; s < atlas_.surfaces.size(); ++s) {
      const Surface& surface = atlas_.surfaces[s];
      const Page& page = atlas_.pages[static_cast<std::size_t>(surface.page)];
      flips.total += static_cast<double>(surface.triangleCount());
      for (std::size_t t = 0; t < surface.triangleCount(); ++t) {
        const Corners p = texelCorners(atlas_, surface, t);
        double longest = 0;
        for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, glm::length(p[(k + 1) % 3] - p[k]));
        const double noise = 4 * kFloatUvStep * std::max(page.width, page.height) * longest;
        const double texels = seenArea(p) * (charts_[surface.charts[t]].signedTexels < 0 ? -1.0 : 1.0);
        if (texels >= -noise) continue;
        ++flips.count;
        setWorst(flips, -texels, static_cast<int>(s), p[0]);
      }
    }
    report_.findings.push_back(flips);
  }

  /// Coverage, charts that come too near to each other, and overlaps.
  void measurePage(int index) {
    const Page& page = atlas_.pages[static_cast<std::size_t>(index)];
    const auto width = static_cast<std::size_t>(page.width);
    report_.pageTexels += static_cast<double>(page.width) * page.height;
    std::vector<std::uint32_t> owner(width * static_cast<std::size_t>(page.height), 0);  // chart + 1
    UvPoints points(page.width, page.height);
    for (const Surface& surface : atlas_.surfaces) {
      if (surface.page != index) continue;
      for (std::size_t t = 0; t < surface.triangleCount(); ++t) {
        const Corners p = texelCorners(atlas_, surface, t);
        ChartFigures& chart = charts_[surface.charts[t]];
        const std::uint32_t id = surface.charts[t] + 1;
        points.forEach(p, [&](std::size_t i) {
          if (points.test(i)) chart.overlap += UvPoints::kTexelsPerPoint;
          points.set(i);
        });
        const Corners snapped = {snapToTexelBorder(p[0]), snapToTexelBorder(p[1]), snapToTexelBorder(p[2])};
        forEachTexelSpan(snapped, {0, 0, page.width, page.height}, 0.0, [&](int y, int x0, int x1) {
          for (int x = x0; x < x1; ++x) {
            std::uint32_t& texel = owner[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)];
            if (texel == 0) report_.coveredTexels += 1;
            if (texel != 0 && texel != id) charts_[texel - 1].near = chart.near = true;
            texel = id;
          }
        });
      }
    }
    findNearCharts(page, owner);
  }

  void findNearCharts(const Page& page, const std::vector<std::uint32_t>& owner) {
    for (int y = 0; y < page.height; ++y)
      for (int x = 0; x < page.width; ++x) {
        const std::uint32_t id =
            owner[static_cast<std::size_t>(y) * static_cast<std::size_t>(page.width) + static_cast<std::size_t>(x)];
        if (id == 0) continue;
        for (int dy = 0; dy <= padding_ && y + dy < page.height; ++dy)
          for (int dx = dy == 0 ? 1 : -padding_; dx <= padding_; ++dx) {
            if (x + dx < 0 || x + dx >= page.width) continue;
            const std::uint32_t other = owner[static_cast<std::size_t>(y + dy) * static_cast<std::size_t>(page.width) +
                                              static_cast<std::size_t>(x + dx)];
            if (other != 0 && other != id) charts_[id - 1].near = charts_[other - 1].near = true;
          }
      }
  }

  /// Numbers for the vertices of all surfaces, in their order: equal where chart, position and UV are.
  std::vector<std::uint32_t> pointNumbers() const {
    using Key = std::tuple<std::uint32_t, std::array<std::uint32_t, 3>, std::array<std::uint32_t, 2>>;
    std::vector<std::pair<Key, std::uint32_t>> vertices;
    for (const Surface& surface : atlas_.surfaces) {
      std::vector<std::uint32_t> chartOf(surface.positions.size(), 0);
      for (std::size_t i = 0; i < surface.indices.size(); ++i) chartOf[surface.indices[i]] = surface.charts[i / 3];
      for (std::size_t i = 0; i < surface.positions.size(); ++i)
        vertices.push_back({{chartOf[i], bitsOf(surface.positions[i]), bitsOf(surface.lightmapUvs[i])},
                            static_cast<std::uint32_t>(vertices.size())});
    }
    std::sort(vertices.begin(), vertices.end());
    std::vector<std::uint32_t> numbers(vertices.size(), 0);
    for (std::size_t i = 1; i < vertices.size(); ++i)
      numbers[vertices[i].second] =
          numbers[vertices[i - 1].second] + (vertices[i].first != vertices[i - 1].first ? 1 : 0);
    return numbers;
  }

  /// Measures edges that a chart runs across: small turns may add up around a point without any edge that breaks.
  void findFrameCrossings() {
    struct Side {
      std::uint32_t low, high;                      // points
      std::uint32_t chart, surface, atLow, atHigh;  // vertices of the surface
    };
    const std::vector<std::uint32_t> numbers = pointNumbers();
    std::vector<Side> sides;
    std::size_t base = 0;
    for (std::uint32_t s = 0; s < atlas_.surfaces.size(); ++s) {
      const Surface& surface = atlas_.surfaces[s];
      for (std::size_t i = 0; i < surface.indices.size(); ++i) {
        std::uint32_t a = surface.indices[i];
        std::uint32_t b = surface.indices[i % 3 == 2 ? i - 2 : i + 1];
        if (numbers[base + a] > numbers[base + b]) std::swap(a, b);
        sides.push_back({numbers[base + a], numbers[base + b], surface.charts[i / 3], s, a, b});
      }
      base += surface.positions.size();
    }
    std::stable_sort(sides.begin(), sides.end(),
                     [](const Side& a, const Side& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; });
    for (std::size_t i = 1; i < sides.size(); ++i) {
      const Side& a = sides[i - 1];
      const Side& b = sides[i];
      if (a.low != b.low || a.high != b.high) continue;
      const Surface& of = atlas_.surfaces[a.surface];
      const Surface& other = atlas_.surfaces[b.surface];
      const auto breaks = [&](std::uint32_t v, std::uint32_t w) {
        const Vec4 t = of.tangents[v];
        const Vec4 u = other.tangents[w];
        return t.w != u.w || glm::dot(Vec3(t), Vec3(u)) < kSameFrameCos;
      };
      if (!breaks(a.atLow, b.atLow) && !breaks(a.atHigh, b.atHigh)) continue;
      charts_[a.chart].crossesFrame = true;
    }
  }

  /// Texels whose parts are of one chart but far apart on the surface.
  void findMixedTexels() {
    LintFinding mixed{.id = "self-mixing",
                      .meaning = "texels that mix places of a chart more than four texels apart on the surface",
                      .level = LintLevel::Warning,
                      .total = report_.coveredTexels,
                      .unit = "texels"};
    const std::vector<PageTexels> pages = findTexels(atlas_);
    for (const PageTexels& page : pages) {
      std::vector<double> apart(page.size(), 0.0);  // texels
      constexpr std::size_t kGrain = 1024;
      parallelFor(page.size(), kGrain, [&](std::size_t first, std::size_t last) {
        TexelFootprint footprint;
        for (std::size_t i = first; i < last; ++i)
          if (page.trianglesOf(i).size() > 1) apart[i] = extentOnSurface(page, i, footprint);
      });
      for (std::size_t i = 0; i < page.size(); ++i) {
        if (!(apart[i] > kFarTexels)) continue;
        ++mixed.count;
        setWorst(mixed, apart[i], static_cast<int>(page.trianglesOf(i)[0].surface),
                 Vec2d(page.coords[i].x, page.coords[i].y));
      }
    }
    report_.findings.push_back(mixed);
  }

  /// Diagonal of the box around the middles of a texel's pieces, as far as they are of its first triangle's chart.
  double extentOnSurface(const PageTexels& page, std::size_t texel, TexelFootprint& footprint) const {
    footprint.clip(atlas_, page, texel);
    const auto chartOf = [this](const TriangleRef& t) { return atlas_.surfaces[t.surface].charts[t.triangle]; };
    const std::uint32_t chart = chartOf(page.trianglesOf(texel)[0]);
    Vec3d low(std::numeric_limits<double>::infinity()), high = -low;
    for (const TexelFootprint::Piece& piece : footprint.pieces()) {
      const TexelFootprint::Source& source = footprint.sources()[piece.source];
      if (chartOf(source.triangle) != chart) continue;
      const std::vector<Vec3>& p = atlas_.surfaces[source.triangle.surface].positions;
      const Vec2d w = piece.middle();
      const Vec3d middle = (1 - w.x - w.y) * Vec3d(p[source.vertices[0]]) + w.x * Vec3d(p[source.vertices[1]]) +
                           w.y * Vec3d(p[source.vertices[2]]);
      low = glm::min(low, middle);
      high = glm::max(high, middle);
    }
    const ChartFigures& figures = charts_[chart];
    return low.x <= high.x && figures.surface > 0
               ? glm::length(high - low) * std::sqrt(figures.texels / figures.surface)
               : 0.0;
  }

  template <class Test, class Value>
  void addCharts(const char* id, const char* meaning, LintLevel level, Test test, Value value) {
    LintFinding finding{
        .id = id, .meaning = meaning, .level = level, .total = static_cast<double>(charts_.size()), .unit = "charts"};
    for (const ChartFigures& chart : charts_) {
      if (chart.surfaceIndex < 0 || !test(chart)) continue;
      ++finding.count;
      setWorst(finding, value(chart), chart.surfaceIndex, chart.place);
    }
    report_.findings.push_back(finding);
  }

  void addChartFindings() {
    double surface = 0, texels = 0;
    for (const ChartFigures& chart : charts_) {
      surface += chart.surface;
      texels += chart.texels;
    }
    LintFinding overlap{.id = "overlap",
                        .meaning = "texels' area covered more than once",
                        .level = LintLevel::Error,
                        .total = texels,
                        .unit = "texels"};
    for (const ChartFigures& chart : charts_) {
      if (!(chart.overlap > 0)) continue;
      overlap.count += chart.overlap;
      setWorst(overlap, chart.overlap, chart.surfaceIndex, chart.place);
    }
    report_.findings.insert(report_.findings.begin(), overlap);
    const auto texelsOf = [](const ChartFigures& c) { return c.texels; };
    addCharts(
        "mirrored", "charts mirrored on the page (their frame is left-handed)", LintLevel::Note,
        [](const ChartFigures& c) { return c.signedTexels < 0; }, texelsOf);
    addCharts(
        "sub-texel", "charts with less area than one texel", LintLevel::Note,
        [](const ChartFigures& c) { return c.texels < 1; }, [](const ChartFigures& c) { return -c.texels; });
    addCharts(
        "tiny", "charts with less area than four texels", LintLevel::Note,
        [](const ChartFigures& c) { return c.texels < 4; }, [](const ChartFigures& c) { return -c.texels; });
    const double mean = surface > 0 ? std::sqrt(texels / surface) : 0.0;
    const auto offMean = [this, mean](const ChartFigures& c) {
      const int instance = atlas_.surfaces[static_cast<std::size_t>(c.surfaceIndex)].instance;
      const double scale = scene_.instances[static_cast<std::size_t>(instance)].settings.texelDensityScale;
      return c.surface > 0 && c.texels > 0 && mean > 0
                 ? std::abs(std::log(std::sqrt(c.texels / c.surface) / (mean * scale)))
                 : 0.0;
    };
    addCharts(
        "density", "charts whose texel density is a quarter or more off the mean", LintLevel::Warning,
        [&offMean](const ChartFigures& c) { return offMean(c) > std::log(1 + kDensityTolerance); }, offMean);
    addCharts(
        "frame-crossing", "charts across which the tangent frame of the bake breaks", LintLevel::Warning,
        [](const ChartFigures& c) { return c.crossesFrame; }, texelsOf);
    addCharts(
        "gap", "charts nearer to another than the padding", LintLevel::Warning,
        [](const ChartFigures& c) { return c.near; }, texelsOf);
  }

  const Scene& scene_;
  const Atlas& atlas_;
  int padding_;
  std::vector<ChartFigures> charts_;
  LintReport report_;
};

}  // namespace

const char* nameOf(LintLevel level) {
  return level == LintLevel::Error ? "error" : level == LintLevel::Warning ? "warning" : "note";
}

LintReport lintAtlas(const Scene& scene, const Atlas& atlas, int padding) {
  return Linter(scene, atlas, padding).run();
}

std::vector<std::string> lintText(const LintReport& report) {
  std::vector<std::string> lines;
  char text[400];
  for (const LintFinding& f : report.findings) {
    if (!(f.count > 0)) continue;
    std::snprintf(text, sizeof text, "%s: %s: %.6g of %.6g %s: %s; worst: ", nameOf(f.level), f.id.c_str(), f.count,
                  f.total, f.unit.c_str(), f.meaning.c_str());
    lines.push_back(text + f.worst + " (page " + std::to_string(f.page) + ", texel " + std::to_string(f.x) + " " +
                    std::to_string(f.y) + ")");
  }
  std::snprintf(text, sizeof text,
                "%zu charts on %zu pages, %.0f of %.0f texels covered (%.1f %%), %.1f MB of half-float maps",
                report.charts, report.pages, report.coveredTexels, report.pageTexels,
                report.pageTexels > 0 ? 100 * report.coveredTexels / report.pageTexels : 0.0, report.mapBytes / 1e6);
  lines.push_back(text);
  return lines;
}

Image chartPicture(const Atlas& atlas, int index) {
  const Page& page = atlas.pages[static_cast<std::size_t>(index)];
  Image image(page.width, page.height, 3);
  for (const Surface& surface : atlas.surfaces) {
    if (surface.page != index) continue;
    for (std::size_t t = 0; t < surface.triangleCount(); ++t) {
      // Neighbouring numbers get hues that are far apart (golden ratio).
      const double hue = 0.618033988749895 * surface.charts[t];
      Vec3 color;
      for (int c = 0; c < 3; ++c) {
        const double wave = std::abs(6 * (hue + c / 3.0 - std::floor(hue + c / 3.0)) - 3) - 1;
        color[c] = static_cast<float>(0.15 + 0.6 * std::clamp(wave, 0.0, 1.0));
      }
      const Corners p = texelCorners(atlas, surface, t);
      const Corners snapped = {snapToTexelBorder(p[0]), snapToTexelBorder(p[1]), snapToTexelBorder(p[2])};
      forEachTexelSpan(snapped, {0, 0, page.width, page.height}, 0.0, [&](int y, int x0, int x1) {
        for (int x = x0; x < x1; ++x)
          if (image.rgb(x, y) == Vec3(0.0f)) image.setRgb(x, y, 0.4f * color);
      });
      UvPoints::forEachCentre(p, page.width, page.height, [&](int x, int y) { image.setRgb(x, y, color); });
    }
  }
  return image;
}

}  // namespace lumel
