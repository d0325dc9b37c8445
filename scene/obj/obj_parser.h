// The one door to tinyobjloader: OBJ and MTL text to plain arrays.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "scene/base/expected.h"
#include "scene/base/math.h"
#include "scene/files/load_options.h"

namespace lumel {

struct ObjCorner {
  int position = 0;
  int texcoord = -1;  // -1: none
  int normal = -1;
};

struct ObjFace {
  std::size_t firstCorner = 0;
  std::size_t corners = 0;      // 3 or more
  int material = -1;            // into ObjFile::materials; -1: none
  unsigned smoothingGroup = 0;  // 0: off
};

/// One object or group.
struct ObjShape {
  std::string name;
  std::vector<ObjCorner> corners;
  std::vector<ObjFace> faces;
};

/// A file that a material reads, with the options of its statement.
struct ObjMap {
  std::string file;  // relative to the scene's folder, with forward slashes; empty: none
  Vec2 offset{0, 0};
  Vec2 scale{1, 1};
  bool clamp = false;
  float bumpScale = 1.0f;
};

struct ObjMaterial {
  std::string name;
  Vec3 diffuse{1, 1, 1};
  Vec3 emission{0, 0, 0};
  float dissolve = 1.0f;
  float roughness = 1.0f;
  float metallic = 0.0f;
  ObjMap diffuseMap;   // map_Kd
  ObjMap emissionMap;  // map_Ke
  ObjMap alphaMap;     // map_d
  ObjMap bumpMap;      // bump, map_bump
  ObjMap normalMap;    // norm
};

struct ObjFile {
  std::vector<Vec3> positions;
  std::vector<Vec2> texcoords;  // v runs up
  std::vector<Vec3> normals;
  std::vector<ObjShape> shapes;
  std::vector<ObjMaterial> materials;
  std::size_t linesAndPoints = 0;     // skipped elements
  std::vector<std::string> warnings;  // missing MTL files and the like
};

/// Parses OBJ text; `name` is for messages, MTL files are looked for in `folder`. All indices of the result are in
/// range and all numbers finite. Errors: Input, naming the line.
Expected<ObjFile> parseObj(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                           const LoadOptions& options);

}  // namespace lumel
