// The lamps of a scene as plain data: those of KHR_lights_punctual, and what extras.lumel.light makes of them.
#pragma once

#include <memory>
#include <string>

#include "scene/base/math.h"
#include "scene/light_profile.h"

namespace lumel {

/// Sources of light brighter than this (candela, lux, nits) are cut to it, so that sums of light stay floats.
inline constexpr float kMostIntensity = 1e32f;

enum class LightType { Point, Spot, Directional, Rectangle, Disc, Sphere };

/// Returns the name of a type in files: that of KHR_lights_punctual, or of extras.lumel.light.
inline const char* nameOf(LightType type) {
  constexpr const char* kNames[] = {"point", "spot", "directional", "rectangle", "disc", "sphere"};
  return kNames[static_cast<int>(type)];
}

/// Tells whether KHR_lights_punctual has the type.
inline bool isPunctual(LightType type) { return type <= LightType::Directional; }
/// Tells whether a light of the type is a flat panel, whose front alone shines.
inline bool isPanel(LightType type) { return type == LightType::Rectangle || type == LightType::Disc; }
/// Returns the unit of Light::intensity.
inline const char* unitOf(LightType type) {
  return type == LightType::Directional ? "lux" : isPanel(type) ? "nits" : "candela";
}

/// What a bake takes of a light; a game adds the rest itself.
enum class LightMode {
  All,       // what arrives straight and by bounces
  Indirect,  // what arrives by bounces
  None,      // nothing
};

inline const char* nameOf(LightMode mode) {
  return mode == LightMode::All ? "all" : mode == LightMode::Indirect ? "indirect" : "none";
}

/// A lamp. Intensity: of points, spots and spheres in candela (lm/sr); directional: lux on a facing surface; of panels
/// radiance in nits. A point, spot or sphere with a radius is a sphere whose every spot shines alike, so that its
/// intensity is that of the point; rays do not see any lamp.
struct Light {
  std::string name;
  LightType type = LightType::Point;
  Vec3 color{1, 1, 1};  // linear
  float intensity = 1.0f;
  Vec3 position{0, 0, 0};    // world; of panels and spheres their centre
  Vec3 direction{0, 0, -1};  // world, unit: where the light travels; the side that a panel shines to
  Vec3 right{1, 0, 0};  // world, unit, across `direction`: the panel's first side, and the plane C = 0 of a profile
  Vec3 up{0, 1, 0};     // world, unit, across both: the second side, and C = 90 degrees
  float range = 0.0f;   // metres; 0 = unlimited; attenuation window as the extension recommends
  float innerConeAngle = 0.0f;
  float outerConeAngle = kPi / 4;
  Vec2 size{0, 0};         // metres: sides of a rectangle
  float radius = 0.0f;     // metres: of discs and spheres, and of points and spots that are soft
  float halfAngle = 0.0f;  // radians: half of what a directional light fills of the sky across
  std::shared_ptr<const LightProfile> profile = {};  // of points, spots and spheres: a factor by direction; null: none
  LightMode mode = LightMode::All;
  bool hasShadowMask = false;  // its visibility is baked where shadow masks are asked for
};

}  // namespace lumel
