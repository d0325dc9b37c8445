#include "scene/load_scene.h"

#include <algorithm>
#include <cctype>

#include "scene/file_access.h"
#include "scene/gltf_loader.h"

namespace lumel {

Expected<Scene> loadScene(const std::filesystem::path& file, const LoadOptions& options) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension != ".gltf" && extension != ".glb")
    return inputError(file.string() + ": '" + extension + "' is not a scene type that can be read; use .gltf, .glb or .obj");
  auto bytes = readFile(file);
  if (!bytes) return bytes.error();
  return loadGltf(*std::move(bytes), file.string(), file.parent_path(), options);
}

}  // namespace lumel
