#include "scene/load/load_scene.h"

#include "scene/files/file_access.h"
#include "scene/gltf/gltf_loader.h"
#include "scene/obj/obj_loader.h"

namespace lumel {

bool isSceneFile(const std::filesystem::path& file) {
  const std::string extension = lowerCaseExtension(file);
  return extension == ".gltf" || extension == ".glb" || extension == ".obj";
}

Expected<Scene> loadScene(const std::filesystem::path& file, const LoadOptions& options) {
  std::error_code ec;
  if (!isSceneFile(file) && !std::filesystem::is_directory(file, ec))  // reading a folder says that it is one
    return inputError(file.string() + ": is not a scene file that can be read; use .gltf, .glb or .obj");
  auto bytes = readFile(file);
  if (!bytes) return bytes.error();
  if (bytes->empty()) return inputError(file.string() + ": the file is empty; export or copy it again");
  const auto folder = file.parent_path();
  if (lowerCaseExtension(file) != ".obj") return loadGltf(*std::move(bytes), file.string(), folder, options);
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  return loadObj(text, file.string(), folder, options);
}

}  // namespace lumel
