#include "baker/light/lit_scene.h"

#include <algorithm>
#include <utility>

namespace lumel {
namespace {

/// Those of one of the two modes that light something, where both are there to be told apart.
std::unique_ptr<PunctualLights> lightsOf(const std::vector<Light>& lights, bool (*ofMode)(LightMode)) {
  if (std::ranges::none_of(lights, [](const Light& light) { return light.mode == LightMode::Indirect; }))
    return nullptr;
  return std::make_unique<PunctualLights>(lights, ofMode);
}

}  // namespace

LitScene::LitScene(const Scene& scene, std::unique_ptr<Materials> materials, std::unique_ptr<RayScene> rays,
                   std::vector<std::string> notes, bool hasAlbedo)
    : notes_(std::move(notes)),
      hasAlbedo_(hasAlbedo),
      materials_(std::move(materials)),
      rays_(std::move(rays)),
      punctual_(scene.lights, [](LightMode mode) { return mode != LightMode::None; }),
      straight_(lightsOf(scene.lights, [](LightMode mode) { return mode == LightMode::All; })),
      hidden_(lightsOf(scene.lights, [](LightMode mode) { return mode == LightMode::Indirect; })),
      emissive_(*rays_, *materials_),
      environment_(scene.environment),
      transport_{*rays_, *materials_, punctual_, emissive_, environment_, straight_.get(), hidden_.get()} {}

Expected<std::unique_ptr<LitScene>> LitScene::build(const Scene& scene, bool needsAlbedo) {
  std::vector<std::string> notes;
  auto materials = std::make_unique<Materials>(scene, needsAlbedo, notes);
  auto rays = RayScene::build(scene, *materials);
  if (!rays) return rays.error();
  return std::unique_ptr<LitScene>(
      new LitScene(scene, std::move(materials), *std::move(rays), std::move(notes), needsAlbedo));
}

}  // namespace lumel
