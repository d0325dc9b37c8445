#include "baker/stills/shading.h"

#include <array>

namespace lumel {
namespace {

Vec3 shadeLit(const SeenPoint& point) {
  return point.isUnlit() ? point.albedo() : point.albedo() * point.light() + point.emission();
}
/// Shows leaks and seams best.
Vec3 shadeLight(const SeenPoint& point) { return point.isUnlit() ? Vec3(0.0f) : point.light(); }
Vec3 shadeAlbedo(const SeenPoint& point) { return point.albedo(); }
Vec3 shadeNormal(const SeenPoint& point) { return point.normal() * 0.5f + 0.5f; }

constexpr std::array<Shading, 4> kShadings = {{
    {"lit", "the lit scene", Shown::Light, true, shadeLit},
    {"lightmap", "the light alone", Shown::Light, false, shadeLight},
    {"albedo", "the albedo", Shown::Color, false, shadeAlbedo},
    {"normal", "world-space normals", Shown::Data, false, shadeNormal},
}};

}  // namespace

std::span<const Shading> shadings() { return kShadings; }

std::string describeShadings() {
  std::string text;
  for (std::size_t i = 0; i < kShadings.size(); ++i) {
    text += i == 0 ? "" : i + 1 < kShadings.size() ? ", " : ", or ";
    text += kShadings[i].shows;
  }
  return text;
}

std::vector<std::string> shadingNames() {
  std::vector<std::string> names;
  for (const Shading& shading : kShadings) names.emplace_back(shading.name);
  return names;
}

}  // namespace lumel
