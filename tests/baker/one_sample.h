// Single light samples for tests that look at one at a time: the first lane of what the lights give to waves.
#pragma once

#include "baker/light/emissive_triangles.h"
#include "baker/light/environment_light.h"
#include "baker/light/light_sample.h"
#include "baker/light/punctual_lights.h"

namespace lumel::testing_scene {

/// One lane of LightSampleLanes.
struct LightSample {
  Vec3 wi{0};
  Vec3 weight{0};
  Vec3 target{0};
  float pdf = 0.0f;
  bool distant = false;
};

inline LightSample sampleOf(const LightSampleLanes& samples, std::size_t lane) {
  return {samples.wi[lane], samples.weight[lane], samples.target[lane], samples.pdf[lane], samples.distant[lane] != 0};
}

inline UnitSquareLanes firstLane(const Vec2& u) {
  UnitSquareLanes lanes{};
  lanes.x[0] = u.x;
  lanes.y[0] = u.y;
  return lanes;
}

inline LightSample sampleOne(const EmissiveTriangles& lights, const Vec3& p, float uTriangle, const Vec2& uPoint) {
  Vec3Lanes points;
  points.set(0, p);
  LightSampleLanes samples;
  lights.sample(points, {1}, UnitLanes{{uTriangle}}, firstLane(uPoint), samples);
  return sampleOf(samples, 0);
}

inline LightSample sampleOne(const EnvironmentLight& sky, bool sun, const Vec2& u) {
  LightSampleLanes samples;
  sun ? sky.sampleSun(firstLane(u), samples) : sky.sampleSky(firstLane(u), samples);
  return sampleOf(samples, 0);
}

/// `near`: without the directional lights.
inline LightSample sampleOne(const PunctualLights& lights, const Vec3& p, const Vec3& n, float u, bool near = false) {
  const LaneFlags active{1};
  Vec3Lanes points, normals;
  points.set(0, p);
  normals.set(0, n);
  const ReceiverLanes at{active, points, normals, normals, points};
  LightSampleLanes samples;
  near ? lights.sampleNear(at, UnitLanes{{u}}, samples) : lights.sample(at, UnitLanes{{u}}, samples);
  return sampleOf(samples, 0);
}

}  // namespace lumel::testing_scene
