#include "scene/load_scene.h"

#include <algorithm>
#include <cctype>

#include "scene/file_access.h"
#include "scene/gltf_loader.h"
#include "scene/obj_loader.h"

namespace lumel {

Expected<Scene> loadScene(const std::filesystem::path& file, const LoadOptions& options) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool isObj = extension == ".obj";
  std::error_code ec;
  if (!isObj && extension != ".gltf" && extension != ".glb" && !std::filesystem::is_directory(file, ec))
    return inputError(file.string() + ": is not a scene file that can be read; use .gltf, .glb or .obj");
  auto bytes = readFile(file);
  if (!bytes) return bytes.error();
  if (bytes->empty()) return inputError(file.string() + ": the file is empty; export or copy it again");
  const auto folder = file.parent_path();
  if (!isObj) return loadGltf(*std::move(bytes), file.string(), folder, options);
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  return loadObj(text, file.string(), folder, options);
}

}  // namespace lumel
