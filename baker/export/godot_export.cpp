// Godot 4: LightmapGIData as text. Read in the engine's source: scene/3d/lightmap_gi.cpp (properties, user_data of
// path, rectangle, slice, sub-instance; probe_data) and scene_forward_clustered.glsl (uv2 * size + position;
// directional layers).
#include <algorithm>
#include <cstdio>
#include <limits>
#include <string>

#include "baker/export/engine_writers.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

/// Rows that an image may have in Godot's own atlases.
constexpr int kMostRows = 16384;

std::string numberText(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", static_cast<double>(value));
  return text;
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string fileNameOf(std::size_t index) {
  return index == 0 ? "lightmap.exr" : "lightmap-" + std::to_string(index) + ".exr";
}

std::string importText(std::size_t slices) {
  return "[remap]\n\nimporter=\"2d_array_texture\"\ntype=\"CompressedTexture2DArray\"\n\n[params]\n\n"
         "compress/mode=3\ncompress/channel_pack=1\nmipmaps/generate=false\nslices/horizontal=1\nslices/vertical=" +
         std::to_string(slices) + "\n";
}

/// Layers one below the other; all have the size of the largest page, smaller ones lie at their top left.
Image stacked(std::span<const Image> layers, int width, int height) {
  Image image(width, height * static_cast<int>(layers.size()), 3);
  for (std::size_t i = 0; i < layers.size(); ++i)
    for (int y = 0; y < layers[i].height; ++y)
      std::copy_n(layers[i].at(0, y), layers[i].width * 3, image.at(0, static_cast<int>(i) * height + y));
  return image;
}

struct Bounds {
  Vec3 least{std::numeric_limits<float>::max()};
  Vec3 most{std::numeric_limits<float>::lowest()};
};

Bounds boundsOf(const Scene& scene) {
  Bounds bounds;
  for (const Instance& instance : scene.instances)
    for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives)
      for (const Vec3& position : primitive.positions) {
        const Vec3 p(instance.worldFromObject * Vec4(position, 1.0f));
        bounds.least = glm::min(bounds.least, p);
        bounds.most = glm::max(bounds.most, p);
      }
  // A thousandth more, as the engine's own bake has it: surfaces at the rim lie inside.
  const Vec3 margin(0.001f * glm::length(bounds.most - bounds.least) + 1e-3f);
  return {bounds.least - margin, bounds.most + margin};
}

std::string vectorText(const Vec3& v) { return numberText(v.x) + ", " + numberText(v.y) + ", " + numberText(v.z); }

/// One black probe in the middle: an engine without any takes the lightmap's bounds for empty and culls it.
std::string probeText(const Bounds& bounds) {
  std::string black;
  for (int i = 0; i < 9; ++i) black += i == 0 ? "0, 0, 0, 1" : ", 0, 0, 0, 1";
  return "{\n\"baked_exposure\": 1.0,\n\"bounds\": AABB(" + vectorText(bounds.least) + ", " +
         vectorText(bounds.most - bounds.least) +
         "),\n\"bsp\": PackedInt32Array(),\n\"interior\": false,\n\"lightprobe_hash\": 0,\n\"points\": "
         "PackedVector3Array(" +
         vectorText(0.5f * (bounds.least + bounds.most)) + "),\n\"sh\": PackedColorArray(" + black +
         "),\n\"tetrahedra\": PackedInt32Array()\n}";
}

std::string usersText(const EngineScene& scene, const BakedScene& baked, int width, int height) {
  std::string text;
  for (const LitNode& node : scene.nodes) {
    const Image& page = baked.flat[static_cast<std::size_t>(node.place.page)];
    const Vec2 share(static_cast<float>(page.width) / static_cast<float>(width),
                     static_cast<float>(page.height) / static_cast<float>(height));
    const Vec2 offset = node.place.offset * share, scale = node.place.scale * share;
    text += (text.empty() ? "" : ", ") + ("NodePath(" + quoted("../scene/" + node.name) + "), Rect2(") +
            numberText(offset.x) + ", " + numberText(offset.y) + ", " + numberText(scale.x) + ", " +
            numberText(scale.y) + "), " + std::to_string(node.place.page) + ", -1";
  }
  return text;
}

std::string resourceText(std::size_t files, bool isDirectional, const std::string& users, const Bounds& bounds) {
  std::string text = "[gd_resource type=\"LightmapGIData\" load_steps=" + std::to_string(files + 1) + " format=3]\n\n";
  std::string textures;
  for (std::size_t i = 0; i < files; ++i) {
    const std::string id = std::to_string(i + 1);
    text += "[ext_resource type=\"CompressedTexture2DArray\" path=\"" + fileNameOf(i) + "\" id=\"" + id + "\"]\n";
    textures += (i == 0 ? "" : ", ") + ("ExtResource(\"" + id + "\")");
  }
  const char* directional = isDirectional ? "true" : "false";
  return text + "\n[resource]\nlightmap_textures = Array[TextureLayered]([" + textures +
         "])\nuses_spherical_harmonics = " + directional + "\nuser_data = [" + users +
         "]\nprobe_data = " + probeText(bounds) + "\n_uses_packed_directional = " + directional + "\n";
}

std::string sceneText(bool isDirectional) {
  return std::string("[gd_scene load_steps=3 format=3]\n\n") +
         "[ext_resource type=\"PackedScene\" path=\"scene.glb\" id=\"1\"]\n"
         "[ext_resource type=\"LightmapGIData\" path=\"lightmap.tres\" id=\"2\"]\n\n"
         "[node name=\"Level\" type=\"Node3D\"]\n\n[node name=\"scene\" parent=\".\" instance=ExtResource(\"1\")]\n\n"
         "[node name=\"LightmapGI\" type=\"LightmapGI\" parent=\".\"]\n" +
         (isDirectional ? "directional = true\n" : "") + "light_data = ExtResource(\"2\")\n";
}

}  // namespace

Expected<Json> writeGodot(const EngineSource& source, ExportFolder& folder) {
  const BakedScene& baked = source.baked;
  if (baked.flat.empty()) return inputError("the bake has no pages; nothing to export");
  int width = 0, height = 0;
  for (const Image& page : baked.flat) {
    width = std::max(width, page.width);
    height = std::max(height, page.height);
  }
  const bool isDirectional = bandsOf(baked, 0).has_value();
  const std::size_t layersPerPage = isDirectional ? 4 : 1;
  const std::size_t pagesPerFile =
      std::max<std::size_t>(1, static_cast<std::size_t>(kMostRows / height) / layersPerPage);
  WriteImageOptions half;
  half.format = PixelFormat::Half;
  Json rows = Json::array();
  std::size_t files = 0;
  source.progress.begin("export", baked.flat.size());
  for (std::size_t first = 0; first < baked.flat.size(); first += pagesPerFile, ++files) {
    std::vector<Image> layers;
    for (std::size_t page = first; page < std::min(first + pagesPerFile, baked.flat.size()); ++page) {
      if (source.progress.cancelled()) return interrupted();
      if (isDirectional) {
        for (Image& layer : godotLayers(*bandsOf(baked, page), baked, page, source.texels[page]))
          layers.push_back(std::move(layer));
      } else {
        layers.push_back(mipImages(baked.flat[page], mipTexels(source.texels[page])).front());
      }
      source.progress.advance(1);
    }
    if (auto done = folder.add(fileNameOf(files), stacked(layers, width, height), half); !done) return done.error();
    if (auto done = folder.add(fileNameOf(files) + ".import", importText(layers.size())); !done) return done.error();
    rows.push_back({{"file", fileNameOf(files)}, {"firstPage", first}, {"layers", layers.size()}});
  }
  source.progress.end();
  const std::string users = usersText(source.scene, baked, width, height);
  if (auto done = folder.add("lightmap.tres", resourceText(files, isDirectional, users, boundsOf(baked.scene))); !done)
    return done.error();
  if (auto done = folder.add("level.tscn", sceneText(isDirectional)); !done) return done.error();
  return rows;
}

}  // namespace lumel
