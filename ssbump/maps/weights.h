// What the three (or N) channels of an ssbump map hold, and the ways from one convention to another.
// An ssbump map is s_i = D_i * o_i: the weight of the texel's normal on basis vector i times the visibility around it.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "scene/base/expected.h"
#include "scene/image.h"

namespace lumel::ssbump {

enum class Convention {
  Squared,  // D_i = sat(N.B_i)^2 / sum_j sat(N.B_j)^2: flat and open is 1/3 each, the sum is 1
  Linear,   // D_i = sat(N.B_i): flat and open is 1/sqrt3 each, as Source-engine tools ship it
  Mod2x,    // 1.5 * Squared: flat and open is 1/2 each, twice the value multiplies an evenly lit texel by 1
};

/// Right: channels in the basis's order for a bitangent that points up the image. Left: G and B swapped, for engines
/// whose bitangent points down.
enum class Hand { Right, Left };

struct Encoding {
  Convention convention = Convention::Squared;
  Hand hand = Hand::Right;
  bool operator==(const Encoding&) const = default;
};

/// "squared", "linear", "mod2x"; "right", "left". Errors: Usage, naming the choices.
Expected<Convention> parseConvention(const std::string& text);
Expected<Hand> parseHand(const std::string& text);
const char* nameOf(Convention convention);
const char* nameOf(Hand hand);

/// The value of each channel of a flat, open texel.
float flatValue(Convention convention);

/// D for a unit tangent-space normal. `basis` of any size; the three RNM vectors where it is empty.
void normalWeights(const Vec3& n, Convention convention, std::span<const Vec3> basis, std::span<float> out);
Vec3 normalWeights(const Vec3& n, Convention convention = Convention::Squared);

/// The normal that three channels stand for, unit; (0, 0, 1) where nothing is left to tell. Right-handed input.
/// Squared: normalise(sum sqrt(s_i) B_i); Linear: normalise(sum s_i B_i).
Vec3 recoveredNormal(const Vec3& s, Convention convention = Convention::Squared);

/// The light that an ssbump texel (squared, right-handed) sends back to a directional light from direction l (unit,
/// tangent space): sum s_i max(0, l.B_i)^2, before albedo.
float litBy(const Vec3& s, const Vec3& l);

/// One texel from one encoding to another. Exact for evenly shadowed texels, and reversible for all of them:
/// squared from linear is s_i^2 / |s|, linear from squared is sqrt(s_i * sum s). Keeps the recovered normal.
Vec3 convert(const Vec3& s, const Encoding& from, const Encoding& to);
/// The same for the first three channels of an image; others pass through.
void convert(Image& image, const Encoding& from, const Encoding& to);

/// Multiplies all three channels of `image` by the detail map's mean channel over its flat value, repeated `repeats`
/// times across: every recovered normal stays as it is. Both maps must share the convention of `encoding`.
void blendDetail(Image& image, const Image& detail, const Encoding& encoding, float repeats);

/// (1 - amount) * a + amount * b per channel, in squared weights. Both maps of the same size, in `encoding`.
Expected<Image> crossFade(const Image& a, const Image& b, const Encoding& encoding, float amount);

/// Multiplies the three channels by the luminance of a linear albedo image stretched over the map.
void modulateByAlbedo(Image& image, const Image& albedoLinear);

/// How a normal map stores its green channel: up (OpenGL, glTF) or down (DirectX).
enum class Green { Up, Down };

/// A stored colour (0..1) to a unit normal. (0, 0, 1) where it has no length. Never points below the surface.
Vec3 decodeNormal(const Vec3& stored, Green green);
Vec3 encodeNormal(const Vec3& n, Green green);

/// Metadata that names the encoding, under keys "lumel:ssbump..." and in one line for formats with a description only.
std::map<std::string, std::string> encodingMetadata(const Encoding& encoding);

/// Bilinear, repeated, at texel coordinates (u, v) in 0..1 of the image; first three channels (grey replicates).
Vec3 sampleRepeated(const Image& image, float u, float v);

}  // namespace lumel::ssbump
