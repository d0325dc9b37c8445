// What a still shows of the surfaces in view: one entry for each word of `lumel render --mode`.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/base/math.h"

namespace lumel {

/// The light of one of the picture's own lamps where it arrives.
struct LampLight {
  Vec3 irradiance{0, 0, 0};  // on a surface that faces it; 0 in its shadow
  Vec3 toLamp{0, 0, 1};      // in the world, unit length
};

/// A point of a surface that a ray of the picture meets. What a shading does not ask for is not computed. Light is
/// irradiance / pi, normals are of unit length.
class SeenPoint {
 public:
  virtual ~SeenPoint() = default;
  virtual bool isUnlit() const = 0;
  virtual Vec3 albedo() const = 0;
  virtual Vec3 emission() const = 0;    // radiance
  virtual float occlusion() const = 0;  // ambient occlusion: of the material's map, else of its ssbump map, else 1
  virtual bool hasSsbump() const = 0;
  virtual Vec3 ssbump() const = 0;         // squared weights times occlusion, right-handed; 1/3 each without a map
  virtual Vec3 tangentNormal() const = 0;  // of the normal map, else of the ssbump map, in tangent space
  virtual Frame frame() const = 0;         // the tangent space in the world; its normal is the smooth one
  virtual Vec3 eye() const = 0;            // direction from the point to the eye, unit length

  virtual bool hasRnm() const = 0;                            // whether the bake's maps are the three RNM ones
  virtual Vec3 map(std::size_t index) const = 0;              // of the encoding; 0 where there are fewer
  virtual Vec3 flat() const = 0;                              // the flat map
  virtual Vec3 decoded(const Vec3& normalTangent) const = 0;  // the light on a normal, by the encoding's decode
  virtual std::span<const LampLight> lamps() const = 0;
  virtual Vec3 sky(const Vec3& direction) const = 0;  // radiance

  virtual float aux(std::string_view channel) const = 0;  // of the nearest texel; NaN where it is not known
  virtual float density() const = 0;                      // texels on a metre; 0 without a lightmap
  virtual int page() const = 0;                           // -1 without a lightmap
  virtual int chart() const = 0;
  virtual Vec2 texel() const = 0;  // place on the page, in texels
};

/// What the pixels of a picture are, which says how they become 8 bits.
enum class Shown {
  Light,   // exposed and bent by the tone curve
  Color,   // encoded as sRGB alone
  Data,    // stored as it is
  Number,  // the first channel through a scale of colours, with a legend
};

struct Shading {
  std::string_view name;   // as --mode has it
  std::string_view shows;  // for the help: "the lit scene"
  Shown shown;
  bool hasSky;  // whether the sky is seen behind the surfaces
  Vec3 (*shade)(const SeenPoint& point);
  std::string_view unit = "";  // of numbers, as their legend names it
};

/// All of them; the first is the one that is used unless told otherwise.
std::span<const Shading> shadings();

/// The one of that name, or nothing.
const Shading* findShading(std::string_view name);

/// A line for each: "lit: the lit scene".
std::string describeShadings();

}  // namespace lumel
