#include "baker/light/emission_field.h"

#include <algorithm>
#include <cmath>

namespace lumel {
namespace {

/// Clamped textures go on for this many texels: further than any texture coordinate reaches (Texture::footprint).
constexpr double kBeyond = 1e11;
/// A polygon that leaves less than this share of a block uncovered covers all of it: clipping rounds.
constexpr double kRounding = 1e-12;
/// Boxes are divided until uniform samples in each would have less than this much more than the least possible second
/// moment in all, as a share of the light.
constexpr double kEvenEnough = 0.05;

/// What a line or a point in the texture meets is looked for within so many texels of it.
constexpr double kBeside = 1e-3;

double cross(const Vec2d& a, const Vec2d& b) { return a.x * b.y - a.y * b.x; }

/// Keeps the part of a polygon where sign * (coordinate - limit) >= 0.
TexelPolygon clipSide(const TexelPolygon& in, int axis, double limit, double sign) {
  TexelPolygon out;
  for (std::size_t i = 0; i < in.count; ++i) {
    const Vec2d& a = in.corners[i];
    const Vec2d& b = in.corners[i + 1 < in.count ? i + 1 : 0];
    const double da = sign * (a[axis] - limit), db = sign * (b[axis] - limit);
    if (da >= 0) out.add(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
      Vec2d corner = a + (b - a) * (da / (da - db));
      corner[axis] = limit;
      out.add(corner);
    }
  }
  return out;
}

TexelBox boundsOf(const TexelPolygon& polygon) {
  TexelBox box{polygon.corners[0], polygon.corners[0]};
  for (std::size_t i = 1; i < polygon.count; ++i) {
    box.min = glm::min(box.min, polygon.corners[i]);
    box.max = glm::max(box.max, polygon.corners[i]);
  }
  return box;
}

TexelBox common(const TexelBox& a, const TexelBox& b) { return {glm::max(a.min, b.min), glm::min(a.max, b.max)}; }
/// Tells whether two boxes share an area.
bool meet(const TexelBox& a, const TexelBox& b) {
  return a.min.x < b.max.x && b.min.x < a.max.x && a.min.y < b.max.y && b.min.y < a.max.y;
}
bool holds(const TexelBox& outer, const TexelBox& inner) {
  return outer.min.x <= inner.min.x && outer.min.y <= inner.min.y && outer.max.x >= inner.max.x &&
         outer.max.y >= inner.max.y;
}
/// Returns the area that two boxes share.
double commonArea(const TexelBox& a, const TexelBox& b) {
  const TexelBox both = common(a, b);
  return std::max(0.0, both.max.x - both.min.x) * std::max(0.0, both.max.y - both.min.y);
}

/// Returns the mean of a bilinear function over a unit square, given at its corners.
double meanOf(const std::array<float, 4>& v) {
  return 0.25 * (static_cast<double>(v[0]) + static_cast<double>(v[1]) + static_cast<double>(v[2]) +
                 static_cast<double>(v[3]));
}

/// Returns the mean of its square: the product of two one-dimensional mass matrices (1/3 on the diagonal, 1/6 beside
/// it).
double meanSquareOf(const std::array<float, 4>& values) {
  const std::array<double, 4> v = {static_cast<double>(values[0]), static_cast<double>(values[1]),
                                   static_cast<double>(values[2]), static_cast<double>(values[3])};
  return (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + v[3] * v[3] + v[0] * v[1] + v[0] * v[2] + v[1] * v[3] +
          v[2] * v[3]) /
             9.0 +
         (v[0] * v[3] + v[1] * v[2]) / 18.0;
}

}  // namespace

double TexelPolygon::area() const {
  double twice = 0.0;
  for (std::size_t i = 2; i < count; ++i) twice += cross(corners[i - 1] - corners[0], corners[i] - corners[0]);
  return 0.5 * std::abs(twice);
}

TexelPolygon clipped(const TexelPolygon& polygon, const TexelBox& box) {
  TexelPolygon left = polygon;
  for (int axis = 0; axis < 2 && left.count >= 3; ++axis) {
    left = clipSide(left, axis, box.min[axis], 1.0);
    left = clipSide(left, axis, box.max[axis], -1.0);
  }
  if (left.count < 3) left.count = 0;
  return left;
}

EmissionField::EmissionField(const Texture& texture, const TextureRef& ref, const Vec3& perColor)
    : texture_(&texture),
      perColor_(perColor),
      nearest_(ref.nearest),
      x_(axisOf(texture.width(), ref.wrapU, ref.nearest)),
      y_(axisOf(texture.height(), ref.wrapV, ref.nearest)) {
  texelFromUv_ = ref.uvMatrix;
  sumUp();
}

EmissionField::Axis EmissionField::axisOf(int size, Wrap wrap, bool nearest) {
  Axis axis;
  axis.period = size;
  axis.tiles = wrap != Wrap::Clamp;
  axis.mirrors = wrap == Wrap::Mirror;
  axis.edges.push_back(0.0);
  if (nearest) {
    for (int i = 0; i < size; ++i) {
      axis.edges.push_back(i + 1.0);
      axis.texels.push_back({i, i});
    }
  } else {
    const int before = wrap == Wrap::Repeat ? size - 1 : 0;
    axis.texels.push_back({before, 0});
    for (int i = 0; i < size; ++i) {
      axis.edges.push_back(i + 0.5);
      axis.texels.push_back({i, i});
    }
    axis.edges.push_back(size);
    axis.texels.push_back({size - 1, wrap == Wrap::Repeat ? 0 : size - 1});
  }
  if (!axis.tiles) {
    axis.edges.front() = -kBeyond;
    axis.edges.back() = kBeyond;
  }
  return axis;
}

float EmissionField::texelAt(int x, int y) const {
  const float luminance = glm::dot(Vec3(texture_->fetch(x, y)), perColor_);
  return luminance > 0.0f && std::isfinite(luminance) ? luminance : 0.0f;
}

/// Returns the value where two edges cross.
float EmissionField::cornerAt(std::size_t x, std::size_t y) const {
  const auto [left, right] = x_.texels[x];
  const auto [top, bottom] = y_.texels[y];
  if (left == right && top == bottom) return texelAt(left, top);
  return 0.25f * (texelAt(left, top) + texelAt(right, top) + texelAt(left, bottom) + texelAt(right, bottom));
}

/// Returns the values at a patch's corners, row by row.
std::array<float, 4> EmissionField::patchAt(std::size_t x, std::size_t y) const {
  if (nearest_) {
    const float value = texelAt(x_.texels[x][0], y_.texels[y][0]);
    return {value, value, value, value};
  }
  return {cornerAt(x, y), cornerAt(x + 1, y), cornerAt(x, y + 1), cornerAt(x + 1, y + 1)};
}

/// Returns the place of `patches` x `patches` patches; x and y count in these.
TexelBox EmissionField::boxOf(std::size_t x, std::size_t y, std::size_t patches) const {
  return {{x_.edges[x * patches], y_.edges[y * patches]},
          {x_.edges[std::min((x + 1) * patches, x_.patches())], y_.edges[std::min((y + 1) * patches, y_.patches())]}};
}

/// Calls visit(x, y) for every patch of a block.
template <class Visit>
void EmissionField::forBlockPatches(std::size_t x, std::size_t y, Visit visit) const {
  for (std::size_t v = y * kBlock; v < std::min((y + 1) * kBlock, y_.patches()); ++v)
    for (std::size_t u = x * kBlock; u < std::min((x + 1) * kBlock, x_.patches()); ++u) visit(u, v);
}

void EmissionField::sumUp() {
  Level blocks{(x_.patches() + kBlock - 1) / kBlock, (y_.patches() + kBlock - 1) / kBlock, {}};
  blocks.sums.resize(blocks.width * blocks.height);
  for (std::size_t y = 0; y < blocks.height; ++y)
    for (std::size_t x = 0; x < blocks.width; ++x)
      forBlockPatches(x, y, [&](std::size_t u, std::size_t v) {
        const std::array<float, 4> values = patchAt(u, v);
        const double area = patchBox(u, v).area();
        blocks.sums[y * blocks.width + x].light += area * meanOf(values);
        blocks.sums[y * blocks.width + x].square += area * meanSquareOf(values);
      });
  levels_.push_back(std::move(blocks));
  while (levels_.back().sums.size() > 1) {
    const Level& finer = levels_.back();
    Level level{(finer.width + 1) / 2, (finer.height + 1) / 2, {}};
    level.sums.resize(level.width * level.height);
    for (std::size_t y = 0; y < finer.height; ++y)
      for (std::size_t x = 0; x < finer.width; ++x) {
        Moments& sum = level.sums[y / 2 * level.width + x / 2];
        sum.light += finer.sums[y * finer.width + x].light;
        sum.square += finer.sums[y * finer.width + x].square;
      }
    levels_.push_back(std::move(level));
  }
}

Vec2d EmissionField::pointOf(const Vec2& uv) const {
  const Vec3 moved = texelFromUv_ * Vec3(uv, 1.0f);
  const auto tame = [](float c) { return std::isfinite(c) ? std::clamp(static_cast<double>(c), -1e6, 1e6) : 0.0; };
  return {tame(moved.x) * x_.period, tame(moved.y) * y_.period};
}

/// Returns the repetitions that a box meets; none where these are more than kMostTiles.
std::vector<EmissionField::Tile> EmissionField::tilesOf(const TexelBox& box) const {
  std::array<double, 2> first{}, count{1.0, 1.0};
  for (int axis = 0; axis < 2; ++axis) {
    const Axis& along = axis == 0 ? x_ : y_;
    const auto a = static_cast<std::size_t>(axis);
    if (!along.tiles) continue;
    first[a] = std::floor(box.min[axis] / along.period);
    count[a] = std::max(1.0, std::ceil(box.max[axis] / along.period) - first[a]);
  }
  std::vector<Tile> tiles;
  if (count[0] * count[1] > kMostTiles) return tiles;
  const auto isOdd = [](double i) { return std::fmod(std::abs(i), 2.0) == 1.0; };
  for (double y = first[1]; y < first[1] + count[1]; ++y)
    for (double x = first[0]; x < first[0] + count[0]; ++x)
      tiles.push_back({{x * x_.period, y * y_.period}, {x_.mirrors && isOdd(x), y_.mirrors && isOdd(y)}});
  return tiles;
}

TexelBox EmissionField::tileBox(const Tile& tile) const {
  const Vec2d least(x_.tiles ? tile.offset.x : -kBeyond, y_.tiles ? tile.offset.y : -kBeyond);
  const Vec2d most(x_.tiles ? tile.offset.x + x_.period : kBeyond, y_.tiles ? tile.offset.y + y_.period : kBeyond);
  return {least, most};
}

/// From the plane to the texture and, because mirroring is its own inverse, back with an offset of zero.
Vec2d EmissionField::toTile(const Tile& tile, const Vec2d& p) const {
  Vec2d local = p - tile.offset;
  if (tile.mirrored[0]) local.x = x_.period - local.x;
  if (tile.mirrored[1]) local.y = y_.period - local.y;
  return local;
}

TexelBox EmissionField::toTile(const Tile& tile, const TexelBox& box) const {
  const Vec2d a = toTile(tile, box.min), b = toTile(tile, box.max);
  return {glm::min(a, b), glm::max(a, b)};
}

double EmissionField::integral(const TexelPolygon& polygon) const {
  if (polygon.count < 3) return 0.0;
  const std::vector<Tile> tiles = tilesOf(boundsOf(polygon));
  if (tiles.empty()) return polygon.area() * levels_.back().sums[0].light / (x_.period * y_.period);
  double sum = 0.0;
  for (const Tile& tile : tiles) {
    TexelPolygon local = tiles.size() > 1 ? clipped(polygon, tileBox(tile)) : polygon;
    for (std::size_t i = 0; i < local.count; ++i) local.corners[i] = toTile(tile, local.corners[i]);
    sum += integralIn(levels_.size() - 1, 0, 0, local);
  }
  return sum;
}

double EmissionField::integralIn(std::size_t level, std::size_t x, std::size_t y, const TexelPolygon& polygon) const {
  const Level& at = levels_[level];
  if (x >= at.width || y >= at.height) return 0.0;
  const Moments& sums = at.sums[y * at.width + x];
  if (!(sums.light > 0.0)) return 0.0;
  const TexelBox box = boxOf(x, y, kBlock << level);
  const TexelPolygon part = clipped(polygon, box);
  if (part.count < 3) return 0.0;
  if (part.area() >= box.area() * (1.0 - kRounding)) return sums.light;
  double sum = 0.0;
  if (level == 0)
    forBlockPatches(x, y, [&](std::size_t u, std::size_t v) { sum += patchIntegral(u, v, part); });
  else
    for (std::size_t child = 0; child < 4; ++child)
      sum += integralIn(level - 1, 2 * x + child % 2, 2 * y + child / 2, part);
  return sum;
}

double EmissionField::patchIntegral(std::size_t x, std::size_t y, const TexelPolygon& polygon) const {
  const std::array<float, 4> values = patchAt(x, y);
  if (!(meanOf(values) > 0.0)) return 0.0;
  const TexelBox box = patchBox(x, y);
  const TexelPolygon part = clipped(polygon, box);
  const auto valueAt = [&](const Vec2d& p) {
    const Vec2d w = glm::clamp((p - box.min) / (box.max - box.min), 0.0, 1.0);
    const double top = glm::mix(static_cast<double>(values[0]), static_cast<double>(values[1]), w.x);
    const double bottom = glm::mix(static_cast<double>(values[2]), static_cast<double>(values[3]), w.x);
    return glm::mix(top, bottom, w.y);
  };
  double sum = 0.0;
  for (std::size_t i = 2; i < part.count; ++i) {
    // The mean of a function of the second degree over a triangle is that of its values half way along the sides.
    const Vec2d &a = part.corners[0], &b = part.corners[i - 1], &c = part.corners[i];
    const double area = 0.5 * std::abs(cross(b - a, c - a));
    sum += area / 3.0 * (valueAt(0.5 * (a + b)) + valueAt(0.5 * (b + c)) + valueAt(0.5 * (c + a)));
  }
  return sum;
}

/// Sums over a box of the texture; where it cuts a patch, in proportion to the area.
EmissionField::Moments EmissionField::momentsIn(std::size_t level, std::size_t x, std::size_t y,
                                                const TexelBox& box) const {
  const Level& at = levels_[level];
  if (x >= at.width || y >= at.height) return {};
  const Moments& sums = at.sums[y * at.width + x];
  const TexelBox place = boxOf(x, y, kBlock << level);
  if (!(sums.light > 0.0) || !meet(box, place)) return {};
  if (holds(box, place)) return sums;
  Moments all;
  if (level == 0) {
    forBlockPatches(x, y, [&](std::size_t u, std::size_t v) {
      const double area = commonArea(patchBox(u, v), box);
      if (!(area > 0.0)) return;
      const std::array<float, 4> values = patchAt(u, v);
      all.light += area * meanOf(values);
      all.square += area * meanSquareOf(values);
    });
    return all;
  }
  for (std::size_t child = 0; child < 4; ++child) {
    const Moments part = momentsIn(level - 1, 2 * x + child % 2, 2 * y + child / 2, box);
    all.light += part.light;
    all.square += part.square;
  }
  return all;
}

/// Extends `lit` about the patches in a box of the texture that shine anywhere.
void EmissionField::growToLit(std::size_t level, std::size_t x, std::size_t y, const TexelBox& box,
                              TexelBox& lit) const {
  const Level& at = levels_[level];
  if (x >= at.width || y >= at.height || !(at.sums[y * at.width + x].light > 0.0)) return;
  const TexelBox place = boxOf(x, y, kBlock << level);
  if (!meet(box, place) || holds(lit, common(place, box))) return;
  if (level > 0) {
    for (std::size_t child = 0; child < 4; ++child)
      growToLit(level - 1, 2 * x + child % 2, 2 * y + child / 2, box, lit);
    return;
  }
  forBlockPatches(x, y, [&](std::size_t u, std::size_t v) {
    const TexelBox patch = patchBox(u, v);
    if (!meet(box, patch) || holds(lit, common(patch, box)) || !(meanOf(patchAt(u, v)) > 0.0)) return;
    const TexelBox part = common(patch, box);
    lit = {glm::min(lit.min, part.min), glm::max(lit.max, part.max)};
  });
}

/// Shrinks a box of the texture about what shines in it. Returns whether anything does.
bool EmissionField::shrinkToLit(TexelBox& box) const {
  TexelBox lit{Vec2d(2.0 * kBeyond), Vec2d(-2.0 * kBeyond)};
  growToLit(levels_.size() - 1, 0, 0, box, lit);
  if (!(lit.min.x <= lit.max.x)) return false;
  box = lit;
  return true;
}

double EmissionField::squareIn(const TexelBox& box) const {
  const std::size_t top = levels_.size() - 1;
  const std::vector<Tile> tiles = tilesOf(box);
  if (tiles.empty()) return box.area() * levels_[top].sums[0].square / boxOf(0, 0, x_.patches()).area();
  double square = 0.0;
  for (const Tile& tile : tiles) square += momentsIn(top, 0, 0, toTile(tile, common(box, tileBox(tile)))).square;
  return square;
}

bool EmissionField::shinesIn(const TexelBox& near) const {
  const TexelBox box{near.min - kBeside, near.max + kBeside};
  const std::vector<Tile> tiles = tilesOf(box);
  if (tiles.empty()) return levels_.back().sums[0].light > 0.0;
  return std::any_of(tiles.begin(), tiles.end(), [&](const Tile& tile) {
    TexelBox local = toTile(tile, common(box, tileBox(tile)));
    return shrinkToLit(local);
  });
}

std::vector<TexelBox> EmissionField::divide(const TexelPolygon& polygon, const Vec2d& meters, std::size_t most) const {
  struct Part {
    TexelBox box;  // on the texture
    Tile tile;
    double light = 0.0;
    double uneven = 0.0;  // the root of area times the square's integral, less the light
  };
  const TexelBox bounds = boundsOf(polygon);
  const std::vector<Tile> tiles = tilesOf(bounds);
  if (tiles.empty()) return {bounds};
  std::vector<Part> parts;
  const auto toPlane = [&](const Part& part) {
    const TexelBox local = toTile({Vec2d(0), part.tile.mirrored}, part.box);
    return TexelBox{local.min + part.tile.offset, local.max + part.tile.offset};
  };
  const auto add = [&](const TexelBox& box, const Tile& tile) {
    Part part{box, tile};
    if (!(box.min.x < box.max.x && box.min.y < box.max.y) || !shrinkToLit(part.box)) return;
    if (clipped(polygon, toPlane(part)).count < 3) return;
    const Moments sums = momentsIn(levels_.size() - 1, 0, 0, part.box);
    part.light = sums.light;
    part.uneven = std::max(0.0, std::sqrt(sums.square * part.box.area()) - sums.light);
    parts.push_back(part);
  };
  for (const Tile& tile : tiles) add(toTile(tile, common(bounds, tileBox(tile))), tile);
  while (parts.size() < most) {
    double light = 0.0, uneven = 0.0;
    std::size_t worst = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      light += parts[i].light;
      uneven += parts[i].uneven;
      if (parts[i].uneven > parts[worst].uneven) worst = i;
    }
    if (!(uneven > kEvenEnough * light)) break;
    const Part part = parts[worst];
    const Vec2d size = (part.box.max - part.box.min) * meters;
    int axis = size.x >= size.y ? 0 : 1;
    double at = part.box.min[axis];
    // The edge of a patch that is nearest to the middle; a single patch is left as it is.
    for (int attempt = 0; attempt < 2; ++attempt, axis = 1 - axis) {
      const std::vector<double>& edges = (axis == 0 ? x_ : y_).edges;
      const auto after = std::upper_bound(edges.begin(), edges.end(), part.box.min[axis]);
      const auto end = std::lower_bound(after, edges.end(), part.box.max[axis]);
      const double middle = 0.5 * (part.box.min[axis] + part.box.max[axis]);
      auto cut = std::lower_bound(after, end, middle);
      if (cut == end && cut != after) --cut;
      if (cut == end) continue;
      if (cut != after && middle - *(cut - 1) < *cut - middle) --cut;
      at = *cut;
      break;
    }
    if (!(at > part.box.min[axis] && at < part.box.max[axis])) {
      parts[worst].uneven = 0.0;
      continue;
    }
    parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(worst));
    TexelBox low = part.box, high = part.box;
    low.max[axis] = at;
    high.min[axis] = at;
    add(low, part.tile);
    add(high, part.tile);
  }
  std::vector<TexelBox> boxes;
  for (const Part& part : parts) boxes.push_back(toPlane(part));
  return boxes;
}

}  // namespace lumel
