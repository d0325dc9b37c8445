// Small glTF files in memory, for tests: JSON as literals, arrays appended to one binary chunk.
#pragma once

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/gltf/gltf_loader.h"

namespace lumel {

struct GltfBuilder {
  nlohmann::json json = {{"asset", {{"version", "2.0"}}}};
  std::vector<std::uint8_t> bin;

  /// Appends bytes (4-aligned) and a buffer view of them; returns the view's index.
  int view(const void* data, std::size_t bytes, int stride = 0) {
    while (bin.size() % 4 != 0) bin.push_back(0);
    nlohmann::json v = {{"buffer", 0}, {"byteOffset", bin.size()}, {"byteLength", bytes}};
    if (stride != 0) v["byteStride"] = stride;
    const auto* p = static_cast<const std::uint8_t*>(data);
    bin.insert(bin.end(), p, p + bytes);
    json["bufferViews"].push_back(v);
    return static_cast<int>(json["bufferViews"].size()) - 1;
  }

  template <class T>
  static constexpr int componentType() {
    if constexpr (std::is_same_v<T, float>)
      return 5126;
    else if constexpr (sizeof(T) == 4)
      return 5125;
    else if constexpr (sizeof(T) == 2)
      return std::is_signed_v<T> ? 5122 : 5123;
    else
      return std::is_signed_v<T> ? 5120 : 5121;
  }

  /// Appends an accessor ("VEC3", ...) over its own tightly packed view; returns its index.
  template <class T>
  int accessor(const std::string& type, const std::vector<T>& values, bool normalized = false) {
    const int components = type == "SCALAR" ? 1 : type == "MAT4" ? 16 : type.back() - '0';
    nlohmann::json a = {{"bufferView", view(values.data(), values.size() * sizeof(T))},
                        {"componentType", componentType<T>()},
                        {"count", values.size() / static_cast<std::size_t>(components)},
                        {"type", type}};
    if (normalized) a["normalized"] = true;
    return add("accessors", a);
  }

  int add(const std::string& array, const nlohmann::json& item) {
    json[array].push_back(item);
    return static_cast<int>(json[array].size()) - 1;
  }

  /// A mesh of one primitive in a node of its own; returns the primitive for changes.
  nlohmann::json& mesh(const nlohmann::json& primitive) {
    const int m = add("meshes", {{"name", "Mesh"}, {"primitives", {primitive}}});
    add("nodes", {{"mesh", m}, {"name", "Node"}});
    return json["meshes"][static_cast<std::size_t>(m)]["primitives"][0];
  }

  /// The unit square in z = 0 seen from +z: positions, indices, UVs with v down (the image stands upright).
  nlohmann::json& square() {
    const int p = accessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
    const int uv = accessor<float>("VEC2", {0, 1, 1, 1, 1, 0, 0, 0});
    const int i = accessor<std::uint16_t>("SCALAR", {0, 1, 2, 0, 2, 3});
    return mesh({{"attributes", {{"POSITION", p}, {"TEXCOORD_0", uv}}}, {"indices", i}});
  }

  std::vector<std::uint8_t> glb() const {
    nlohmann::json complete = json;
    if (!complete.contains("buffers")) complete["buffers"] = nlohmann::json::array();
    if (complete["buffers"].empty()) complete["buffers"].push_back({{"byteLength", bin.size()}});
    std::string text = complete.dump();
    while (text.size() % 4 != 0) text.push_back(' ');
    std::vector<std::uint8_t> data = bin;
    while (data.size() % 4 != 0) data.push_back(0);
    std::vector<std::uint8_t> out;
    const auto u32 = [&](std::size_t v) {
      for (int s = 0; s < 32; s += 8) out.push_back(static_cast<std::uint8_t>(v >> s));
    };
    const auto chars = [&](const char* s, std::size_t n) { out.insert(out.end(), s, s + n); };
    chars("glTF", 4);
    u32(2);
    u32(12 + 8 + text.size() + 8 + data.size());
    u32(text.size());
    chars("JSON", 4);
    chars(text.data(), text.size());
    u32(data.size());
    chars("BIN\0", 4);
    out.insert(out.end(), data.begin(), data.end());
    return out;
  }

  Expected<Scene> load(const std::filesystem::path& folder = "/nonexistent", const LoadOptions& options = {}) const {
    return loadGltf(glb(), "test.glb", folder, options);
  }
};

/// The scene, or an empty one with the error as a test failure.
#define LOAD_OR_FAIL(scene, expression)                        \
  auto scene##Loaded = (expression);                           \
  ASSERT_TRUE(scene##Loaded) << scene##Loaded.error().message; \
  const Scene& scene = *scene##Loaded

}  // namespace lumel
