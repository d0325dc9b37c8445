// Small valid glTF files with much in them, for tests of compression and for fuzzing.
// The meshopt and Draco data are the unit square, encoded once with meshoptimizer 0.18 and Draco 1.5.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "scene/files/file_access.h"
#include "tests/scene/gltf_builder.h"

namespace lumel {

inline constexpr const char* kPositions =
    "oAAAATMAAAD//wEzAAAAfn0AAAEMAAAA/wEMAAAAfgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA==";
inline constexpr const char* kPositionsTimes3Exponential =
    "oAABMwAAAGBfAAEwAAAABAABDAAAAGAAATAAAAAEAAAAATAAAAAEAAAAAAAAAAAAAAAAAAAAAAAAAAAAAADyAAAA8gAAAPI=";
inline constexpr const char* kNormalsOctahedral = "oAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAADZ/AA==";
inline constexpr const char* kRotationsQuaternion =
    "oAEQAAAAATAAAAD+AAAAAAEQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAP9/";
inline constexpr const char* kTriangles = "4fAAAHaHVmd4qYZliWiYAWkAAA==";
inline constexpr const char* kIndexSequence = "0QAEBAYIBAAAAAA=";
// Positions (11 bits), UVs (10 bits), colours (255, 51, 0, 255); attribute ids 0, 1, 2.
inline constexpr const char* kDraco =
    "RFJBQ08CAgEBAAAABAICAgAAAR//ARH/ARH/ARED/wAAAAAAAQAAAQAJAwAAAgEDCQIAAQIBAgIEAAIBAQEBAAMDATABEAMAKIKYAAAAAAD/"
    "BwAAAAAAAAAAAAAAAAAAAACAPwsBAQEAAwMBIAEgAwDwg6YAAAAAAP8DAAAAAAAAAAAAAAAAgD8KAQEBAQFnATQBCP+PAQQEAJk+jQAAAAD/"
    "AAAA";

inline std::vector<std::uint8_t> decoded(const std::string& base64) { return *decodeDataUri("data:;base64," + base64); }

/// Adds a view that is compressed with `extension` and whose plain bytes are in a buffer without any.
inline int compressedView(GltfBuilder& g, const char* base64, int count, int stride, const char* mode,
                          const char* filter = "NONE", const char* extension = "EXT_meshopt_compression") {
  const auto bytes = decoded(base64);
  const int at = g.view(bytes.data(), bytes.size());
  nlohmann::json& view = g.json["bufferViews"][static_cast<std::size_t>(at)];
  nlohmann::json compressed = {{"buffer", 0},
                               {"byteOffset", view["byteOffset"]},
                               {"byteLength", view["byteLength"]},
                               {"byteStride", stride},
                               {"count", count},
                               {"mode", mode},
                               {"filter", filter}};
  view = {{"buffer", 1}, {"byteLength", count * stride}, {"extensions", {{extension, compressed}}}};
  return at;
}

inline GltfBuilder meshoptSquare(const char* indices, const char* mode,
                                 const char* extension = "EXT_meshopt_compression") {
  GltfBuilder g;
  g.json["extensionsRequired"] = {extension};
  const int p =
      g.add("accessors", {{"bufferView", compressedView(g, kPositions, 4, 12, "ATTRIBUTES", "NONE", extension)},
                          {"componentType", 5126},
                          {"count", 4},
                          {"type", "VEC3"}});
  const int n = g.add(
      "accessors", {{"bufferView", compressedView(g, kNormalsOctahedral, 4, 4, "ATTRIBUTES", "OCTAHEDRAL", extension)},
                    {"componentType", 5120},
                    {"normalized", true},
                    {"count", 4},
                    {"type", "VEC3"}});
  g.json["bufferViews"].back()["byteStride"] = 4;
  const int i = g.add("accessors", {{"bufferView", compressedView(g, indices, 6, 4, mode, "NONE", extension)},
                                    {"componentType", 5125},
                                    {"count", 6},
                                    {"type", "SCALAR"}});
  g.mesh({{"attributes", {{"POSITION", p}, {"NORMAL", n}}}, {"indices", i}});
  g.json["buffers"] = {{{"byteLength", g.bin.size()}},
                       {{"byteLength", 88}, {"extensions", {{extension, {{"fallback", true}}}}}}};
  return g;
}

inline GltfBuilder dracoSquare() {
  GltfBuilder g;
  g.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  const auto bytes = decoded(kDraco);
  const int view = g.view(bytes.data(), bytes.size());
  const auto attribute = [&](int type, const char* shape, bool normalized) {
    return g.add("accessors", {{"componentType", type}, {"count", 4}, {"type", shape}, {"normalized", normalized}});
  };
  const int p = attribute(5126, "VEC3", false), uv = attribute(5126, "VEC2", false),
            color = attribute(5121, "VEC4", true);
  g.mesh({{"attributes", {{"POSITION", p}, {"TEXCOORD_0", uv}, {"COLOR_0", color}}},
          {"indices", g.add("accessors", {{"componentType", 5123}, {"count", 6}, {"type", "SCALAR"}})},
          {"extensions",
           {{"KHR_draco_mesh_compression",
             {{"bufferView", view}, {"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}, {"COLOR_0", 2}}}}}}}});
  return g;
}

/// A square with every attribute, morph target, skin, sparse positions, materials, lights, cameras and instancing.
inline GltfBuilder richSquare() {
  GltfBuilder g;
  auto& primitive = g.square();
  auto& attributes = primitive["attributes"];
  const std::vector<float> offsets = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  attributes["COLOR_0"] = g.accessor<std::uint8_t>("VEC4", std::vector<std::uint8_t>(16, 200), true);
  attributes["TEXCOORD_1"] = g.accessor<std::uint16_t>("VEC2", {0, 0, 9000, 0, 9000, 9000, 0, 9000}, true);
  attributes["JOINTS_0"] = g.accessor<std::uint8_t>("VEC4", std::vector<std::uint8_t>(16, 0));
  attributes["WEIGHTS_0"] = g.accessor<float>("VEC4", std::vector<float>(16, 0.25f));
  primitive["targets"] = {{{"POSITION", g.accessor<float>("VEC3", offsets)}}};
  primitive["material"] = 0;
  const std::uint8_t index = 2;
  const float value[] = {1, 1, 0.5f};
  const int indexView = g.view(&index, 1), valueView = g.view(value, sizeof value);
  g.json["accessors"][0]["sparse"] = {{"count", 1},
                                      {"indices", {{"bufferView", indexView}, {"componentType", 5121}}},
                                      {"values", {{"bufferView", valueView}}}};
  const int t = g.accessor<float>("VEC3", {0, 0, 0, 7, 0, 0});
  g.json["meshes"][0]["weights"] = {0.5};
  g.json["images"] = {{{"uri", "data:image/png;base64,iVBORw0KGgo="}},
                      {{"bufferView", indexView}, {"mimeType", "image/png"}}};
  g.json["samplers"] = {{{"wrapS", 33071}, {"magFilter", 9728}}};
  g.json["textures"] = {{{"source", 0}, {"sampler", 0}}, {{"extensions", {{"EXT_texture_webp", {{"source", 1}}}}}}};
  const nlohmann::json transform = {{"KHR_texture_transform", {{"scale", {2, 3}}, {"rotation", 1}, {"texCoord", 1}}}};
  g.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}, {"extensions", transform}}}}},
                          {"normalTexture", {{"index", 0}, {"texCoord", 1}}},
                          {"emissiveTexture", {{"index", 1}}},
                          {"alphaMode", "MASK"}}};
  g.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "spot"}, {"spot", {{"innerConeAngle", 0.1}}}}};
  g.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.7}, {"znear", 0.1}}}}};
  g.json["skins"] = {{{"joints", {1}}}};
  g.json["nodes"] = {{{"children", {1, 2, 3}}, {"scale", {1, -2, 1}}},
                     {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}, {"camera", 0}},
                     {{"mesh", 0},
                      {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", t}}}}}}},
                      {"extras", {{"lumel", {{"scale", 2}}}}}},
                     {{"mesh", 0}, {"skin", 0}, {"weights", {1}}}};
  g.json["scenes"] = {{{"nodes", {0}}}};
  g.json["scene"] = 0;
  return g;
}

/// Named files that load as they are.
inline std::vector<std::pair<std::string, GltfBuilder>> gltfSamples() {
  GltfBuilder plain;
  plain.square();
  return {{"plain", plain},
          {"rich", richSquare()},
          {"meshopt", meshoptSquare(kTriangles, "TRIANGLES")},
          {"draco", dracoSquare()}};
}

}  // namespace lumel
