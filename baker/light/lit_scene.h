// A scene as light meets it: made once, and shared by all bakes of it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "baker/light/light_transport.h"
#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

/// Owns what LightTransport refers to.
class LitScene {
 public:
  /// Decodes textures and builds Embree's trees and the tables of lights. Keeps a reference to `scene`, which must not
  /// change. `needsAlbedo` false: nothing is shaded, light with bounces cannot be asked for. Errors: Failed (Embree,
  /// memory).
  static Expected<std::unique_ptr<LitScene>> build(const Scene& scene, bool needsAlbedo);

  LitScene(const LitScene&) = delete;
  LitScene& operator=(const LitScene&) = delete;

  const LightTransport& transport() const { return transport_; }
  bool hasAlbedo() const { return hasAlbedo_; }
  /// A line for each texture that could not be decoded.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  LitScene(const Scene& scene, std::unique_ptr<Materials> materials, std::unique_ptr<RayScene> rays,
           std::vector<std::string> notes, bool hasAlbedo);

  std::vector<std::string> notes_;
  bool hasAlbedo_;
  std::unique_ptr<Materials> materials_;
  std::unique_ptr<RayScene> rays_;
  PunctualLights punctual_;
  std::unique_ptr<PunctualLights> straight_, hidden_;  // LightTransport
  EmissiveTriangles emissive_;
  EnvironmentLight environment_;
  LightTransport transport_;
};

}  // namespace lumel
