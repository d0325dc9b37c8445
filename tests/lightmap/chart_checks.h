// What every atlas must hold, measured from its surfaces alone.
#pragma once

#include "lightmap/atlas/atlas.h"

namespace lumel {

struct AtlasFigures {
  std::size_t charts = 0;
  std::size_t triangles = 0;
  std::size_t flipped = 0;           // turned over by more than a float UV's rounding
  std::size_t mirroredTangents = 0;  // generated frames with w != +1
  double overlapTexels = 0;          // covered twice, at 16 points per texel
  double coveredTexels = 0;
  double minDensity = 0, maxDensity = 0;  // of charts, texels per metre
  double worstStretch = 0;  // area-weighted 99th percentile of max(s, 1/s) over singular values s, at nominal density
  double surface = 0;       // square metres
  std::size_t outside = 0;  // vertices off the page
};

AtlasFigures measureAtlas(const Atlas& atlas);

/// One instance of one mesh, with flat normals where `normals` are empty.
Scene sceneOf(std::vector<Vec3> positions, std::vector<std::uint32_t> indices, std::vector<Vec3> normals = {});

/// One smooth hilly surface of 2 * cells^2 triangles over a square of `side` metres.
Scene terrain(int cells, double side);

/// buildAtlas with generated charts; fails the test on an error.
AtlasResult chartsOf(const Scene& scene, float texelsPerMeter, int pageSize = 512);

}  // namespace lumel
