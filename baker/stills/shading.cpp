#include "baker/stills/shading.h"

#include <algorithm>
#include <cmath>

#include "ssbump/maps/weights.h"

namespace lumel {
namespace {

/// The lamps of the picture on a normal.
Vec3 lampsOn(const SeenPoint& point, const Vec3& normalTangent) {
  const Frame frame = point.frame();
  const Vec3 normal = frame.fromLocal(normalTangent);
  Vec3 sum(0.0f);
  for (const LampLight& lamp : point.lamps())
    if (glm::dot(frame.n, lamp.toLamp) > 0.0f)
      sum += lamp.irradiance * (kInvPi * std::max(0.0f, glm::dot(normal, lamp.toLamp)));
  return sum;
}

/// The lamps by weights on the RNM basis (Green 2007). Three times, and with the base surface's cosine: a flat texel's
/// weights are thirds, and it gets what a plain surface gets.
Vec3 lampsOnWeights(const SeenPoint& point, const Vec3& s) {
  const Frame frame = point.frame();
  Vec3 sum(0.0f);
  for (const LampLight& lamp : point.lamps()) {
    const Vec3 l = frame.toLocal(lamp.toLamp);
    if (l.z > 0.0f) sum += lamp.irradiance * (kInvPi * l.z * 3.0f * ssbump::litBy(s, l));
  }
  return sum;
}

Vec3 onNormal(const SeenPoint& point, const Vec3& normalTangent) {
  return point.decoded(normalTangent) + lampsOn(point, normalTangent);
}

/// Weights that replace those of a normal in the decode. Of maps that are not the RNM ones the light on the recovered
/// normal is taken, times the weights' sum.
Vec3 onWeights(const SeenPoint& point, const Vec3& s) {
  const Vec3 baked = point.hasRnm() ? s.x * point.map(0) + s.y * point.map(1) + s.z * point.map(2)
                                    : (s.x + s.y + s.z) * point.decoded(ssbump::recoveredNormal(s));
  return baked + lampsOnWeights(point, s);
}

/// The weights of the normal alone.
Vec3 openWeights(const SeenPoint& point) { return ssbump::normalWeights(ssbump::recoveredNormal(point.ssbump())); }

Vec3 lightOf(const SeenPoint& point) {
  return point.hasSsbump() ? onWeights(point, point.ssbump()) : onNormal(point, point.tangentNormal());
}

Vec3 lit(const SeenPoint& point, const Vec3& light) {
  return point.isUnlit() ? point.albedo() : point.albedo() * light + point.emission();
}

constexpr Vec3 kFlatNormal(0.0f, 0.0f, 1.0f);

Vec3 shadeLit(const SeenPoint& p) { return lit(p, lightOf(p)); }
/// Shows leaks and seams best.
Vec3 shadeLight(const SeenPoint& p) { return p.isUnlit() ? Vec3(0.0f) : lightOf(p); }
Vec3 shadeFlat(const SeenPoint& p) { return lit(p, p.flat() + lampsOn(p, kFlatNormal)); }
Vec3 shadeFlatDot(const SeenPoint& p) {
  const Vec3 n = p.tangentNormal();
  return lit(p, p.flat() * std::max(0.0f, n.z) + lampsOn(p, n));
}
Vec3 shadeNormalMapped(const SeenPoint& p) { return lit(p, onNormal(p, p.tangentNormal())); }
/// Occlusion darkens what is baked, not the lamps, as game engines have it.
Vec3 shadeOccluded(const SeenPoint& p) {
  const Vec3 n = p.tangentNormal();
  return lit(p, p.occlusion() * p.decoded(n) + lampsOn(p, n));
}
Vec3 shadeSsbump(const SeenPoint& p) { return lit(p, onWeights(p, p.ssbump())); }
Vec3 shadeSsbumpOpen(const SeenPoint& p) { return lit(p, onWeights(p, openWeights(p))); }

template <std::size_t I>
Vec3 shadeBasis(const SeenPoint& p) {
  return p.isUnlit() ? Vec3(0.0f) : p.map(I);
}
template <std::size_t I>
Vec3 shadeMasked(const SeenPoint& p) {
  return p.isUnlit() ? Vec3(0.0f) : p.map(I) * p.ssbump()[static_cast<glm::length_t>(I)];
}

/// A flat, open texel is mid grey.
Vec3 shadeChannels(const SeenPoint& p) { return 1.5f * p.ssbump(); }
Vec3 shadeRecovered(const SeenPoint& p) { return ssbump::recoveredNormal(p.ssbump()) * 0.5f + 0.5f; }
Vec3 shadeRecoveredWorld(const SeenPoint& p) {
  return p.frame().fromLocal(ssbump::recoveredNormal(p.ssbump())) * 0.5f + 0.5f;
}
Vec3 mirrored(const SeenPoint& p, const Vec3& normal) {
  const Vec3 eye = p.eye();
  return p.sky(2.0f * glm::dot(normal, eye) * normal - eye);
}
Vec3 shadeReflection(const SeenPoint& p) {
  const Vec3 n = p.hasSsbump() ? ssbump::recoveredNormal(p.ssbump()) : p.tangentNormal();
  return mirrored(p, p.frame().fromLocal(n));
}
Vec3 shadeReflectionPlain(const SeenPoint& p) { return mirrored(p, p.frame().n); }
Vec3 shadeAlbedo(const SeenPoint& p) { return p.albedo(); }
Vec3 shadeNormal(const SeenPoint& p) { return p.frame().fromLocal(p.tangentNormal()) * 0.5f + 0.5f; }

/// Colours that are far apart for numbers that follow each other: hues by the golden ratio.
Vec3 colorOf(int number) {
  if (number < 0) return Vec3(0.02f);
  const float hue = 6.0f * std::fmod(0.61803399f * static_cast<float>(number), 1.0f);
  const auto channel = [&](float shift) {
    const float h = std::fmod(hue + shift, 6.0f);
    return 0.15f + 0.6f * std::clamp(std::abs(h - 3.0f) - 1.0f, 0.0f, 1.0f);
  };
  return {channel(0.0f), channel(4.0f), channel(2.0f)};
}
Vec3 shadeChecker(const SeenPoint& p) {
  if (p.page() < 0) return Vec3(0.02f);
  const Vec2 texel = p.texel();
  const int square = (static_cast<int>(std::floor(texel.x)) + static_cast<int>(std::floor(texel.y))) & 1;
  return colorOf(p.chart()) * (square != 0 ? 1.0f : 0.45f);
}
Vec3 shadeChart(const SeenPoint& p) { return colorOf(p.page() < 0 ? -1 : p.chart()); }
Vec3 shadePage(const SeenPoint& p) { return colorOf(p.page()); }
Vec3 shadeDensity(const SeenPoint& p) { return Vec3(p.density()); }
Vec3 shadeCoverage(const SeenPoint& p) { return Vec3(p.aux("coverage")); }
Vec3 shadeValidity(const SeenPoint& p) { return Vec3(p.aux("validity")); }
Vec3 shadeError(const SeenPoint& p) {
  const float light = luminance(p.flat());
  return Vec3(light > 0.0f ? 100.0f * p.aux("stderr") / light : 0.0f);
}
Vec3 shadeSamples(const SeenPoint& p) { return Vec3(p.aux("samples")); }

constexpr Shading kShadings[] = {
    {"lit", "the lit scene, by ssbump maps where materials have them, else by normal maps", Shown::Light, true,
     shadeLit},
    {"lightmap", "its light alone, without albedo", Shown::Light, false, shadeLight},
    {"flat", "lit by the flat map", Shown::Light, true, shadeFlat},
    {"flat-dot", "lit by the flat map times the cosine between mapped and plain normal", Shown::Light, true,
     shadeFlatDot},
    {"normal-mapped", "lit by the light on mapped normals", Shown::Light, true, shadeNormalMapped},
    {"normal-mapped-ao", "the same times ambient occlusion", Shown::Light, true, shadeOccluded},
    {"ssbump", "lit by ssbump maps", Shown::Light, true, shadeSsbump},
    {"ssbump-open", "lit by ssbump maps without their occlusion", Shown::Light, true, shadeSsbumpOpen},
    {"basis0", "the first map of the bake", Shown::Light, false, shadeBasis<0>},
    {"basis1", "the second", Shown::Light, false, shadeBasis<1>},
    {"basis2", "the third", Shown::Light, false, shadeBasis<2>},
    {"masked0", "the first map times its ssbump channel", Shown::Light, false, shadeMasked<0>},
    {"masked1", "the second", Shown::Light, false, shadeMasked<1>},
    {"masked2", "the third", Shown::Light, false, shadeMasked<2>},
    {"ssbump-channels", "the three channels as a colour, flat and open as mid grey", Shown::Data, false, shadeChannels},
    {"recovered", "tangent-space normals from ssbump maps", Shown::Data, false, shadeRecovered},
    {"recovered-world", "the same in the world", Shown::Data, false, shadeRecoveredWorld},
    {"reflection", "the sky in mirrors of mapped normals", Shown::Light, true, shadeReflection},
    {"reflection-plain", "the sky in mirrors of plain normals", Shown::Light, true, shadeReflectionPlain},
    {"albedo", "the albedo", Shown::Color, false, shadeAlbedo},
    {"normal", "world-space normals", Shown::Data, false, shadeNormal},
    {"checker", "the texels of the lightmap as squares", Shown::Color, false, shadeChecker},
    {"chart", "a colour for each chart", Shown::Color, false, shadeChart},
    {"page", "a colour for each page", Shown::Color, false, shadePage},
    {"density", "texels per metre", Shown::Number, false, shadeDensity, "texels per m"},
    {"coverage", "the share of a texel that is covered", Shown::Number, false, shadeCoverage},
    {"validity", "the share of rays that met no back of a surface", Shown::Number, false, shadeValidity},
    {"error", "standard error of the light in per cent", Shown::Number, false, shadeError, "%"},
    {"samples", "gather rays per texel", Shown::Number, false, shadeSamples, "rays"},
};

}  // namespace

std::span<const Shading> shadings() { return kShadings; }

const Shading* findShading(std::string_view name) {
  const auto* found = std::ranges::find(kShadings, name, &Shading::name);
  return found == std::end(kShadings) ? nullptr : found;
}

std::string describeShadings() {
  std::string text;
  for (const Shading& shading : kShadings) {
    text += text.empty() ? "" : "; ";
    text += std::string(shading.name) + ": " + std::string(shading.shows);
  }
  return text;
}

}  // namespace lumel
