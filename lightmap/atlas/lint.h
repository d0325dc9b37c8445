// What is wrong, wasteful or suspicious in an atlas before hours are spent on baking it. Measured from the finished
// surfaces alone, so scene-supplied and generated UVs are judged alike.
#pragma once

#include <string>
#include <vector>

#include "lightmap/atlas/atlas.h"
#include "scene/image.h"

namespace lumel {

enum class LintLevel { Note, Warning, Error };
const char* nameOf(LintLevel level);  // "note", "warning", "error"

/// One kind of finding. `count` of `total` things; the worst one by name and place.
struct LintFinding {
  std::string id{};       // "overlap", for programs
  std::string meaning{};  // one line for people
  LintLevel level = LintLevel::Note;
  double count = 0.0;
  double total = 0.0;
  std::string unit{};   // of count and total: "texels", "charts", "triangles", "vertices"
  std::string worst{};  // name of the instance and primitive; empty without a finding
  int page = -1;        // where the worst one is
  int x = 0, y = 0;     // texel of that page
  double worstValue = 0.0;
};

struct LintReport {
  std::vector<LintFinding> findings;  // always all kinds, in a fixed order; count 0 where all is well
  double coveredTexels = 0.0;         // that will be baked (conservative coverage)
  double pageTexels = 0.0;
  double mapBytes = 0.0;  // of a bake's maps in memory and as half floats: three RNM maps and the flat one
  std::size_t charts = 0;
  std::size_t pages = 0;
};

/// Kinds: overlap (texels where a chart lies on another or on itself, at 16 points per texel), out-of-range (vertices
/// off the page), flip (triangles turned over within their chart), mirrored (charts), lost (triangles with a surface
/// but no texels), sub-texel (charts below one texel's area), tiny (below four), density (charts more than a quarter
/// off the mean density of their kind), frame-crossing (charts with an edge inside at which the bake frame breaks), gap
/// (charts that another comes nearer to than `padding`), self-mixing (texels that hold places of one chart that are
/// more than four texels apart on the surface, as at a strip that was laid back along a wall).
LintReport lintAtlas(const Scene& scene, const Atlas& atlas, int padding);

/// One line per finding that has something to say, and a line of totals.
std::vector<std::string> lintText(const LintReport& report);

/// A page with each chart in a colour of its own (by its number), linear RGB; darker where a chart covers a texel only
/// in part.
Image chartPicture(const Atlas& atlas, int page);

}  // namespace lumel
