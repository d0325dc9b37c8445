#include "scene/images/ssbump_maps.h"

#include "scene/files/file_access.h"
#include "scene/images/image_type.h"

namespace lumel {

Expected<void> setSsbumpMap(Scene& scene, Material& material, const std::filesystem::path& file) {
  auto bytes = readFile(file);
  if (!bytes) return bytes.error();
  ImageSource source;
  source.name = file.filename().string();
  source.encoded = *std::move(bytes);
  source.mimeType = imageMimeType(source.encoded);
  if (source.mimeType.empty())
    return inputError(file.string() + ": is not an image of a known type; ssbump maps are PNG, EXR, TIFF or DDS");
  const TextureRef& like = material.normalMap ? material.normalMap : material.baseColorMap;
  if (like) material.ssbumpMap = like;
  material.ssbumpMap.image = static_cast<int>(scene.images.size());
  scene.images.push_back(std::move(source));
  return {};
}

Expected<void> assignSsbumpMaps(Scene& scene, const LoadOptions& options) {
  for (const auto& [name, file] : options.ssbump) {
    bool found = false;
    for (Material& material : scene.materials) {
      if (material.name != name) continue;
      found = true;
      material.ssbumpForm.clear();
      material.ssbumpHand.clear();
      if (auto set = setSsbumpMap(scene, material, file); !set) return set;
    }
    if (!found) {
      std::string known;
      for (const Material& material : scene.materials)
        if (!material.name.empty()) known += (known.empty() ? "'" : ", '") + material.name + "'";
      return inputError("--ssbump: no material is named '" + name + "'; the scene has " +
                        (known.empty() ? "none with a name" : known));
    }
  }
  return {};
}

}  // namespace lumel
