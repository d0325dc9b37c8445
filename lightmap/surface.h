// Lightmapped surfaces: the scene's geometry in world space, cut at chart borders, with its place in the atlas.
// Made by parameterization (atlas.h), read by texel sampling, by the baker and by the writer of scene.glb.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/base/math.h"
#include "scene/scene.h"

namespace lumel {

/// The part of one primitive of one instance that lies on one atlas page. A primitive whose charts need several
/// pages becomes several surfaces. Vertex arrays have one entry per vertex.
struct Surface {
  int instance = 0;   // into Scene::instances
  int primitive = 0;  // into the primitives of that instance's mesh
  int page = 0;       // into Atlas::pages

  std::vector<Vec3> positions;              // world
  std::vector<Vec3> normals;                // world, unit; on the front side of the triangle as wound in `indices`
  std::vector<Vec4> tangents;               // world, unit; the bake frame: t = xyz, b = w * cross(n, t)
  std::vector<Vec2> lightmapUvs;            // in the page's 0..1, u right, v down
  std::vector<std::uint32_t> sourceVertex;  // vertex of the source primitive that this one copies

  std::vector<std::uint32_t> indices;         // three per triangle; counter-clockwise from the front in world space
                                              // (already reversed for mirroring instances)
  std::vector<std::uint32_t> sourceTriangle;  // per triangle: triangle of the source primitive
  std::vector<std::uint32_t> charts;          // per triangle: into Atlas::charts

  std::size_t triangleCount() const { return indices.size() / 3; }
};

struct Page {
  int width = 0;   // texels
  int height = 0;  // texels
};

struct Chart {
  int surface = 0;  // the first with a triangle of it; others may follow: of the same instance and page
  // May differ per chart where it was snapped or scaled per object.
  float texelsPerMeter = 0.0f;
  // How the next bake finds a generated chart again (layout_memory.h); key 0: it came with the scene's UVs.
  std::uint64_t key = 0;
  int quarterTurns = 0;
  int x = 0;  // of its box's corner on its page, in texels
  int y = 0;
};

struct Atlas {
  std::vector<Surface> surfaces;  // ordered by instance, primitive, page
  std::vector<Page> pages;
  std::vector<Chart> charts;
  // One per instance of the scene: where its own lightmap UVs lie; page -1 with generated charts, or without lightmap.
  std::vector<LightmapPlace> places;
  float texelsPerMeter = 0.0f;  // nominal density, as given or as found to fill the page; 0 with scene UVs alone
  double chartDensity = 0.0;    // that generated charts were made for, before they were scaled to it by chartScale
  double chartScale = 1.0;
  int sceneUvPages = 0;  // the first pages hold UVs that the scene gives as places on pages
};

}  // namespace lumel
