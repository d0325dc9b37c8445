#include "scene/load/load_scene.h"

#include <algorithm>

#include "scene/files/file_access.h"
#include "scene/gltf/gltf_loader.h"
#include "scene/obj/obj_loader.h"

namespace lumel {
namespace {

/// Takes maps without bytes out of the materials: colour becomes grey, emission black.
void replaceMissingMaps(Scene& scene) {
  const auto isMissing = [&](const TextureRef& ref) {
    return ref && scene.images[static_cast<std::size_t>(ref.image)].encoded.empty();
  };
  for (Material& material : scene.materials) {
    if (isMissing(material.baseColorMap))
      material.baseColor = Vec4(kMissingColor * Vec3(material.baseColor), material.baseColor.w);
    if (isMissing(material.emissionMap)) material.emission = Vec3(0.0f);
    for (TextureRef* ref : {&material.baseColorMap, &material.emissionMap, &material.normalMap, &material.ssbumpMap,
                            &material.occlusionMap, &material.metallicRoughnessMap})
      if (isMissing(*ref)) *ref = {};
  }
}

/// Cuts light to kMostIntensity, with a warning.
void limitLight(Scene& scene) {
  const auto warn = [&](const std::string& what) {
    scene.report.warnings.push_back(what + " is brighter than 1e32 and is cut to it; correct its strength");
  };
  for (Light& light : scene.lights) {
    const float peak = std::max({light.color.x, light.color.y, light.color.z});
    if (light.intensity * std::max(peak, 1.0f) <= kMostIntensity) continue;
    warn("light '" + light.name + "'");
    light.color /= std::max(peak, 1.0f);
    light.intensity = std::min(light.intensity, kMostIntensity);
  }
  for (Material& material : scene.materials) {
    const float peak = std::max({material.emission.x, material.emission.y, material.emission.z});
    if (peak <= kMostIntensity) continue;
    warn("material '" + material.name + "'");
    material.emission = glm::min(material.emission, Vec3(kMostIntensity));
  }
}

Expected<Scene> loadByExtension(const std::filesystem::path& file, const LoadOptions& options) {
  auto bytes = readFile(file);
  if (!bytes) return bytes.error();
  if (bytes->empty()) return inputError(file.string() + ": the file is empty; export or copy it again");
  const auto folder = file.parent_path();
  if (lowerCaseExtension(file) != ".obj") return loadGltf(*std::move(bytes), file.string(), folder, options);
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  return loadObj(text, file.string(), folder, options);
}

}  // namespace

bool isSceneFile(const std::filesystem::path& file) {
  const std::string extension = lowerCaseExtension(file);
  return extension == ".gltf" || extension == ".glb" || extension == ".obj";
}

Expected<Scene> loadScene(const std::filesystem::path& file, const LoadOptions& options) {
  std::error_code ec;
  if (!isSceneFile(file) && !std::filesystem::is_directory(file, ec))  // reading a folder says that it is one
    return inputError(file.string() + ": is not a scene file that can be read; use .gltf, .glb or .obj");
  auto scene = loadByExtension(file, options);
  if (!scene) return scene;
  replaceMissingMaps(*scene);
  limitLight(*scene);
  return scene;
}

}  // namespace lumel
