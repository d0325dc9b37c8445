#include "scene/obj/obj_parser.h"

#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <sstream>

#include "scene/files/file_access.h"
#include "scene/obj/obj_check.h"

namespace lumel {
namespace {

std::string forwardSlashes(std::string text) {
  std::replace(text.begin(), text.end(), '\\', '/');
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r')) text.pop_back();
  return text;
}

/// tinyobjloader takes a colour of 0.6 for a textured material without Kd, and 0 without a texture; a factor that is
/// not given is 1.
std::string withDefaultColors(const std::vector<std::uint8_t>& bytes) {
  std::istringstream in(std::string(bytes.begin(), bytes.end()));
  std::string text;
  for (std::string line; std::getline(in, line);) {
    text += line + "\n";
    const auto start = line.find_first_not_of(" \t");
    if (start != std::string::npos && line.compare(start, 6, "newmtl") == 0) text += "Kd 1 1 1\n";
  }
  return text;
}

class MtlReader : public tinyobj::MaterialReader {
 public:
  MtlReader(const std::string& name, const std::filesystem::path& folder, const LoadOptions& options)
      : name_(name), folder_(folder), options_(options) {}

  bool operator()(const std::string& file, std::vector<tinyobj::material_t>* materials, std::map<std::string, int>* ids,
                  std::string* warning, std::string* error) override {
    auto path = resolveReference(folder_, forwardSlashes(file), options_);
    if (!path) {
      refusal = inputError(name_ + ": mtllib: " + path.error().message);
      return false;
    }
    auto bytes = readFile(*path);
    if (!bytes) {
      warnings.push_back(name_ + ": mtllib: " + bytes.error().message + "; faces get a default material");
      return true;
    }
    std::istringstream text(withDefaultColors(*bytes));
    tinyobj::LoadMtl(ids, materials, &text, warning, error);
    return true;
  }

  std::optional<Error> refusal;
  std::vector<std::string> warnings;

 private:
  const std::string& name_;
  const std::filesystem::path& folder_;
  const LoadOptions& options_;
};

float finiteOr(float value, float fallback) { return std::isfinite(value) ? value : fallback; }

ObjMap mapOf(const std::string& file, const tinyobj::texture_option_t& options) {
  ObjMap map;
  map.file = forwardSlashes(file);
  map.offset = {finiteOr(options.origin_offset[0], 0), finiteOr(options.origin_offset[1], 0)};
  map.scale = {finiteOr(options.scale[0], 1), finiteOr(options.scale[1], 1)};
  map.clamp = options.clamp;
  map.bumpScale = finiteOr(options.bump_multiplier, 1);
  return map;
}

ObjMaterial convert(const tinyobj::material_t& source) {
  ObjMaterial material;
  material.name = source.name;
  for (int c = 0; c < 3; ++c) {
    material.diffuse[c] = std::clamp(finiteOr(source.diffuse[c], 1), 0.0f, 1.0f);
    material.emission[c] = std::max(finiteOr(source.emission[c], 0), 0.0f);
  }
  material.dissolve = std::clamp(finiteOr(source.dissolve, 1), 0.0f, 1.0f);
  // 0 is what tinyobjloader holds for "not given".
  if (source.roughness > 0) material.roughness = std::min(source.roughness, 1.0f);
  material.metallic = std::clamp(finiteOr(source.metallic, 0), 0.0f, 1.0f);
  material.diffuseMap = mapOf(source.diffuse_texname, source.diffuse_texopt);
  material.emissionMap = mapOf(source.emissive_texname, source.emissive_texopt);
  material.alphaMap = mapOf(source.alpha_texname, source.alpha_texopt);
  material.bumpMap = mapOf(source.bump_texname, source.bump_texopt);
  material.normalMap = mapOf(source.normal_texname, source.normal_texopt);
  return material;
}

ObjShape convert(const tinyobj::shape_t& source) {
  ObjShape shape;
  shape.name = source.name;
  const auto& mesh = source.mesh;
  shape.corners.reserve(mesh.indices.size());
  for (const auto& index : mesh.indices)
    shape.corners.push_back({index.vertex_index, index.texcoord_index, index.normal_index});
  std::size_t corner = 0;
  for (std::size_t f = 0; f < mesh.num_face_vertices.size(); ++f) {
    shape.faces.push_back({corner, mesh.num_face_vertices[f], mesh.material_ids[f], mesh.smoothing_group_ids[f]});
    corner += mesh.num_face_vertices[f];
  }
  return shape;
}

template <class V>
std::vector<V> vectorsOf(const std::vector<float>& flat) {
  std::vector<V> vectors(flat.size() / (sizeof(V) / sizeof(float)));
  if (!vectors.empty()) std::memcpy(vectors.data(), flat.data(), vectors.size() * sizeof(V));
  return vectors;
}

/// checkObjText has seen to the ranges; this keeps that a fact if tinyobjloader reads a line in another way.
bool indicesInRange(const ObjFile& file) {
  const auto fits = [](int index, std::size_t count) { return index < static_cast<std::int64_t>(count); };
  for (const ObjShape& shape : file.shapes) {
    if (!shape.faces.empty() && shape.faces.back().firstCorner + shape.faces.back().corners != shape.corners.size())
      return false;
    for (const ObjFace& face : shape.faces)
      if (face.corners < 3 || face.material < -1 || !fits(face.material, file.materials.size())) return false;
    for (const ObjCorner& c : shape.corners)
      if (c.position < 0 || c.texcoord < -1 || c.normal < -1 || !fits(c.position, file.positions.size()) ||
          !fits(c.texcoord, file.texcoords.size()) || !fits(c.normal, file.normals.size()))
        return false;
  }
  return true;
}

/// Some exporters write faces as "v//vn" and leave the normals out.
void dropNormalsThatAreNot(ObjFile& file, std::vector<std::string>& warnings, const std::string& name) {
  if (!file.normals.empty()) return;
  bool any = false;
  for (ObjShape& shape : file.shapes)
    for (ObjCorner& corner : shape.corners) {
      any = any || corner.normal >= 0;
      corner.normal = -1;
    }
  if (any) warnings.push_back(name + ": faces refer to normals, but there are none; they are made");
}

Expected<ObjFile> parse(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                        const LoadOptions& options) {
  if (const auto problem = checkObjText(text))
    return inputError(name + ": " + *problem + "; repair the file or export it again");
  std::istringstream stream{std::string(text)};
  tinyobj::attrib_t attributes;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warning, error;
  MtlReader reader(name, folder, options);
  const bool loaded =
      tinyobj::LoadObj(&attributes, &shapes, &materials, &warning, &error, &stream, &reader, false, false);
  if (reader.refusal) return *reader.refusal;
  if (!loaded) {
    std::replace(error.begin(), error.end(), '\n', ' ');
    return inputError(name + ": " + (error.empty() ? "cannot be parsed" : error));
  }
  ObjFile file;
  file.positions = vectorsOf<Vec3>(attributes.vertices);
  file.texcoords = vectorsOf<Vec2>(attributes.texcoords);
  file.normals = vectorsOf<Vec3>(attributes.normals);
  for (const auto& material : materials) file.materials.push_back(convert(material));
  for (const auto& shape : shapes) {
    file.linesAndPoints += shape.lines.num_line_vertices.size() + (shape.points.indices.empty() ? 0 : 1);
    if (!shape.mesh.indices.empty()) file.shapes.push_back(convert(shape));
  }
  dropNormalsThatAreNot(file, reader.warnings, name);
  if (!indicesInRange(file)) return inputError(name + ": a face cannot be read; export the file again");
  file.warnings = std::move(reader.warnings);
  return file;
}

}  // namespace

Expected<ObjFile> parseObj(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                           const LoadOptions& options) {
  try {
    return parse(text, name, folder, options);
  } catch (const std::exception& e) {
    return inputError(name + ": cannot be parsed: " + e.what());
  }
}

}  // namespace lumel
