// From surfaces to texels: which texels of a page are covered by which triangles, and how to sample points on the
// covered part of a texel. Samples never lie off the surface: the footprint is clipped by the chart.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "lightmap/surface.h"

namespace lumel {

struct TriangleRef {
  std::uint32_t surface = 0;   // into Atlas::surfaces
  std::uint32_t triangle = 0;  // of that surface
  auto operator<=>(const TriangleRef&) const = default;
};

struct TexelCoord {
  std::uint16_t x = 0;
  std::uint16_t y = 0;
};

/// The covered texels of one page. Memory: 8 bytes per texel and 8 per texel-triangle overlap.
struct PageTexels {
  int width = 0;
  int height = 0;
  std::vector<TexelCoord> coords;            // covered texels in 4x4 tiles: tiles row by row, row by row within
  std::vector<std::uint32_t> firstTriangle;  // [coords.size() + 1] into triangles
  std::vector<TriangleRef> triangles;        // in order of (surface, triangle) within a texel

  std::size_t size() const { return coords.size(); }
  std::span<const TriangleRef> trianglesOf(std::size_t texel) const {
    return std::span(triangles).subspan(firstTriangle[texel], firstTriangle[texel + 1] - firstTriangle[texel]);
  }
};

/// Conservative coverage: every texel that shares positive area with a triangle. UVs within 1/1024 texel of a texel's
/// border count as on it, so that rounding to float adds no texels. Triangles without area in the atlas, or with UVs
/// that are not finite, get none; what lies outside the page is cut off. Parallel and deterministic.
std::vector<PageTexels> findTexels(const Atlas& atlas);

/// A point of the surface inside a texel, ready to gather light at.
struct SurfacePoint {
  Vec3 position;         // world
  Vec3 geometricNormal;  // world, unit, front side
  Frame frame;           // world; the bake frame, orthonormal: n is the shading normal
  TriangleRef triangle;
  Vec3 barycentric;  // of the triangle's three vertices
};

/// The covered part of one texel: its triangles clipped to the texel's square, as pieces that can be sampled uniformly
/// by area. Reused between texels to save allocation, and between neighbours triangles.
class TexelFootprint {
 public:
  struct Source {  // a triangle of the texel
    TriangleRef triangle;
    std::array<std::uint32_t, 3> vertices;
    Vec3 geometricNormal;
    std::array<Vec2d, 3> texels;  // its corners on the page, snapped (raster.h)
    Vec2d perTexel1, perTexel2;   // how the weights of vertices 1 and 2 grow across the page
  };
  /// A triangle; or the whole square, of which three corners are kept: the fourth lies opposite of the first.
  struct Piece {
    std::uint32_t source = 0;         // into sources()
    std::array<Vec2, 3> barycentric;  // of the piece's corners: weights of vertices 1 and 2
    double areaBefore = 0.0;          // summed area of the pieces before this one
    double area = 0.0;
    bool isSquare = false;

    Vec2d middle() const {
      const std::array<Vec2d, 3> c = {Vec2d(barycentric[0]), Vec2d(barycentric[1]), Vec2d(barycentric[2])};
      return isSquare ? 0.5 * (c[1] + c[2]) : (c[0] + c[1] + c[2]) / 3.0;
    }
  };

  /// Clips (Sutherland and Hodgman 1974) in double precision. Returns the covered area in texels, 0..1 (more than 1
  /// where scene UVs overlap); 0: nothing to sample.
  double clip(const Atlas& atlas, const PageTexels& page, std::size_t texel);

  double area() const { return area_; }

  /// Uniform over the covered area for u uniform in [0, 1)^2 (area-preserving, so stratified u stay stratified within
  /// a piece). Precondition: area() > 0.
  SurfacePoint sample(Vec2 u) const;

  /// Returns the point of a piece's triangle, with weights of its source's vertices 1 and 2 as the pieces' corners
  /// have.
  SurfacePoint at(std::size_t piece, Vec2 barycentric) const { return pointOn(pieces_[piece], barycentric); }

  /// Area-weighted mean of the covered part, moved onto the nearest piece if it falls outside: one representative
  /// point for single-ray work and for reports.
  SurfacePoint centroid() const;

  /// The point of a piece with these weights of vertices 1 and 2.
  SurfacePoint pointOn(const Piece& piece, Vec2 barycentric) const;

  /// What sample() chooses from, for callers that draw many points.
  std::span<const Source> sources() const { return sources_; }
  std::span<const Piece> pieces() const { return pieces_; }

 private:
  Source sourceOf(const TriangleRef& ref) const;

  const Atlas* atlas_ = nullptr;
  int width_ = 0;  // of the page
  int height_ = 0;
  std::vector<Source> sources_;
  std::vector<Source> before_;  // of the texel before
  std::vector<Piece> pieces_;
  double area_ = 0.0;
};

}  // namespace lumel
