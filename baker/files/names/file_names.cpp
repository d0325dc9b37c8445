#include "baker/files/names/file_names.h"

#include <string_view>

namespace lumel {
namespace {

bool isPageImage(const std::string& name) {
  constexpr std::string_view prefix = "lightmap-";
  if (name.rfind(prefix, 0) != 0) return false;
  const std::size_t dash = name.find_first_not_of("0123456789", prefix.size());
  if (dash == std::string::npos || dash == prefix.size()) return false;
  const std::string rest = name.substr(dash);
  return rest == "-rnm0.exr" || rest == "-rnm1.exr" || rest == "-rnm2.exr" || rest == "-flat.exr" || rest == "-aux.exr";
}

}  // namespace

std::string pageFileName(std::size_t page, const std::string& kind) {
  return "lightmap-" + std::to_string(page) + "-" + kind + ".exr";
}

bool isBakeFile(const std::string& name) {
  return isPageImage(name) || name == "sky.exr" || name == "scene.glb" || name == "bake.json";
}

}  // namespace lumel
