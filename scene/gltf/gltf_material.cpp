#include "scene/gltf/gltf_material.h"

#include <algorithm>
#include <cmath>

#include "scene/files/file_access.h"
#include "scene/images/image_type.h"
#include "scene/images/ssbump_maps.h"

namespace lumel {
namespace {

constexpr int kClampToEdge = 33071;
constexpr int kMirroredRepeat = 33648;
constexpr int kNearest = 9728;
constexpr std::size_t kNoImage = static_cast<std::size_t>(-1);

Wrap wrapOf(int mode) {
  return mode == kClampToEdge ? Wrap::Clamp : mode == kMirroredRepeat ? Wrap::Mirror : Wrap::Repeat;
}

float toFloat(double value) { return static_cast<float>(value); }

Vec3 vec3Of(const std::vector<double>& v) { return {toFloat(v[0]), toFloat(v[1]), toFloat(v[2])}; }
Vec4 vec4Of(const std::vector<double>& v) { return {vec3Of(v), toFloat(v[3])}; }

/// KHR_texture_transform: translation * rotation * scale. A positive rotation turns counter-clockwise as the image
/// is seen (v down), as the Khronos test model, three.js and Blender have it.
Mat3 uvMatrixOf(const tinygltf::Value& transform) {
  const auto component = [&](const char* key, int i, double fallback) {
    return transform.Has(key) ? transform.Get(key).Get(i).GetNumberAsDouble() : fallback;
  };
  const double rotation = valueNumber(transform, "rotation", 0.0);
  const double c = std::cos(rotation), s = std::sin(rotation);
  const double sx = component("scale", 0, 1), sy = component("scale", 1, 1);
  return {Vec3(toFloat(c * sx), toFloat(-s * sx), 0), Vec3(toFloat(s * sy), toFloat(c * sy), 0),
          Vec3(toFloat(component("offset", 0, 0)), toFloat(component("offset", 1, 0)), 1)};
}

class MaterialLoader {
 public:
  MaterialLoader(const GltfDocument& document, Scene& scene)
      : document_(document), scene_(scene), imageSlots_(document.images.size(), -1) {}

  Expected<void> run();

 private:
  Material convert(const tinygltf::Material& source);
  TextureRef texture(int textureIndex, int texCoord, const tinygltf::Value* transform);
  int image(int fileImage);
  int noImage();
  Expected<ImageSource> load(const GltfImage& image, std::size_t index);
  Expected<void> readSsbump(const tinygltf::Material& source, std::size_t index);

  const GltfDocument& document_;
  Scene& scene_;
  std::vector<int> imageSlots_;      // per image of the file: index in scene.images, or -1
  std::vector<std::size_t> wanted_;  // images of the file in scene order
};

int MaterialLoader::image(int fileImage) {
  int& slot = imageSlots_[static_cast<std::size_t>(fileImage)];
  if (slot < 0) {
    slot = static_cast<int>(wanted_.size());
    wanted_.push_back(static_cast<std::size_t>(fileImage));
  }
  return slot;
}

/// Returns the place of an image without bytes, which is shared by all textures that have none that can be read.
int MaterialLoader::noImage() {
  const auto it = std::find(wanted_.begin(), wanted_.end(), kNoImage);
  const auto slot = static_cast<int>(it - wanted_.begin());
  if (it == wanted_.end()) wanted_.push_back(kNoImage);
  return slot;
}

TextureRef MaterialLoader::texture(int textureIndex, int texCoord, const tinygltf::Value* transform) {
  TextureRef ref;
  if (textureIndex < 0) return ref;
  const auto& source = document_.model.textures[static_cast<std::size_t>(textureIndex)];
  int fileImage = source.source;
  if (const auto* webp = findExtension(source.extensions, "EXT_texture_webp"))
    fileImage = static_cast<int>(valueNumber(*webp, "source", fileImage));
  const bool isReadable = fileImage >= 0;
  if (!isReadable) {
    const bool basisu = findExtension(source.extensions, "KHR_texture_basisu") != nullptr;
    scene_.report.warnings.push_back(
        document_.name + ": textures/" + std::to_string(textureIndex) + ": has no image " +
        (basisu ? "beside that of KHR_texture_basisu, which is not read; export PNG, too" : "that can be read") +
        "; colour counts as grey, emission as black");
  }
  ref.image = isReadable ? image(fileImage) : noImage();
  ref.uvSet = texCoord;
  if (source.sampler >= 0) {
    const auto& sampler = document_.model.samplers[static_cast<std::size_t>(source.sampler)];
    ref.wrapU = wrapOf(sampler.wrapS);
    ref.wrapV = wrapOf(sampler.wrapT);
    ref.nearest = sampler.magFilter == kNearest;
  }
  if (transform) {
    ref.uvMatrix = uvMatrixOf(*transform);
    ref.uvSet = static_cast<int>(valueNumber(*transform, "texCoord", texCoord));
  }
  return ref;
}

Material MaterialLoader::convert(const tinygltf::Material& source) {
  const auto refOf = [&](const auto& info) {
    return texture(info.index, info.texCoord, findExtension(info.extensions, "KHR_texture_transform"));
  };
  Material material;
  material.name = source.name;
  const auto& pbr = source.pbrMetallicRoughness;
  material.baseColor = vec4Of(pbr.baseColorFactor);
  material.baseColorMap = refOf(pbr.baseColorTexture);
  material.metallic = toFloat(pbr.metallicFactor);
  material.roughness = toFloat(pbr.roughnessFactor);
  material.metallicRoughnessMap = refOf(pbr.metallicRoughnessTexture);
  material.normalMap = refOf(source.normalTexture);
  material.normalScale = toFloat(source.normalTexture.scale);
  material.occlusionMap = refOf(source.occlusionTexture);
  material.occlusionStrength = toFloat(source.occlusionTexture.strength);
  material.emission = vec3Of(source.emissiveFactor);
  material.emissionMap = refOf(source.emissiveTexture);
  material.alphaMode = source.alphaMode == "MASK"    ? AlphaMode::Mask
                       : source.alphaMode == "BLEND" ? AlphaMode::Blend
                                                     : AlphaMode::Opaque;
  material.alphaCutoff = toFloat(source.alphaCutoff);
  material.doubleSided = source.doubleSided;
  material.unlit = findExtension(source.extensions, "KHR_materials_unlit") != nullptr;
  if (const auto* strength = findExtension(source.extensions, "KHR_materials_emissive_strength"))
    material.emission *= toFloat(valueNumber(*strength, "emissiveStrength", 1.0));
  if (const auto* thin = findExtension(source.extensions, "KHR_materials_transmission")) {
    material.transmission = std::clamp(toFloat(valueNumber(*thin, "transmissionFactor", 0.0)), 0.0f, 1.0f);
    if (material.transmission > 0.0f && thin->Has("transmissionTexture"))
      scene_.report.warnings.push_back(document_.name + ": material '" + source.name +
                                       "': transmissionTexture is not read; transmissionFactor applies everywhere");
  }
  if (const auto* specular = findExtension(source.extensions, "KHR_materials_pbrSpecularGlossiness")) {
    // It takes the place of the other model, whose members are for programs that do not know it.
    material.baseColor = Vec4(1.0f);
    material.baseColorMap = material.metallicRoughnessMap = {};
    material.metallic = 0.0f;
    if (specular->Has("diffuseFactor"))
      for (int c = 0; c < 4; ++c)
        material.baseColor[c] = toFloat(specular->Get("diffuseFactor").Get(c).GetNumberAsDouble());
    if (specular->Has("diffuseTexture")) {
      const auto& info = specular->Get("diffuseTexture");
      const auto& extensions = info.Has("extensions") ? info.Get("extensions") : info;
      const auto* transform =
          extensions.Has("KHR_texture_transform") ? &extensions.Get("KHR_texture_transform") : nullptr;
      material.baseColorMap = texture(static_cast<int>(valueNumber(info, "index", -1)),
                                      static_cast<int>(valueNumber(info, "texCoord", 0)), transform);
    }
  }
  return material;
}

Expected<ImageSource> MaterialLoader::load(const GltfImage& image, std::size_t index) {
  const std::string place = "images/" + std::to_string(index);
  ImageSource source;
  source.name = !image.uri.empty() && !isDataUri(image.uri) ? percentDecode(image.uri)
                : image.name.empty()                        ? "image " + std::to_string(index)
                                                            : image.name;
  const auto missing = [&](const std::string& why) {
    scene_.report.warnings.push_back(document_.name + ": " + place + ": " + why +
                                     "; colour counts as grey, emission as black");
    source.encoded.clear();
    return source;
  };
  if (isDataUri(image.uri)) {
    auto bytes = decodeDataUri(image.uri);
    if (!bytes) return missing(bytes.error().message);
    source.encoded = *std::move(bytes);
  } else if (!image.uri.empty()) {
    auto file = resolveReference(document_.folder, source.name, document_.options);
    if (!file) return document_.error(place + "/uri", file.error().message);
    auto bytes = readFile(*file);
    if (!bytes) return missing(bytes.error().message);
    source.encoded = *std::move(bytes);
  } else if (image.bufferView >= 0) {
    auto bytes = document_.viewBytes(image.bufferView);
    if (!bytes) return bytes.error();
    source.encoded.assign(bytes->begin(), bytes->end());
  } else {
    return missing("has neither uri nor bufferView");
  }
  source.mimeType = imageMimeType(source.encoded);
  if (source.mimeType.empty()) return missing("is not an image of a known type (PNG, JPEG, WebP, ...)");
  return source;
}

/// "extras": {"lumel": {"ssbump": {"file": "wall.png", "convention": "squared", "hand": "right", "texCoord": 0}}}
Expected<void> MaterialLoader::readSsbump(const tinygltf::Material& source, std::size_t index) {
  if (!source.extras.IsObject() || !source.extras.Has("lumel")) return {};
  const std::string place = "materials/" + std::to_string(index) + "/extras/lumel";
  const auto& lumel = source.extras.Get("lumel");
  if (!lumel.IsObject())
    return document_.error(place, "must be an object such as {\"ssbump\": {\"file\": \"wall.png\"}}");
  for (const std::string& key : lumel.Keys())
    if (key != "ssbump") return document_.error(place, "'" + key + "' is not known; use ssbump");
  if (!lumel.Has("ssbump")) return {};
  const auto& ssbump = lumel.Get("ssbump");
  if (!ssbump.IsObject() || !ssbump.Has("file") || !ssbump.Get("file").IsString())
    return document_.error(place + "/ssbump", "must name a file: {\"file\": \"wall.png\"}");
  Material& material = scene_.materials[index];
  std::optional<int> uvSet;
  for (const std::string& key : ssbump.Keys()) {
    const auto& value = ssbump.Get(key);
    const std::string text = value.IsString() ? value.Get<std::string>() : "";
    if (key == "convention") {
      if (text != "squared" && text != "linear" && text != "mod2x")
        return document_.error(place + "/ssbump/convention", "must be squared, linear or mod2x");
      material.ssbumpForm = text;
    } else if (key == "hand") {
      if (text != "right" && text != "left") return document_.error(place + "/ssbump/hand", "must be right or left");
      material.ssbumpHand = text;
    } else if (key == "texCoord") {
      if (!value.IsInt() || value.Get<int>() < 0)
        return document_.error(place + "/ssbump/texCoord", "must be the number of a UV set");
      uvSet = value.Get<int>();
    } else if (key != "file") {
      return document_.error(place + "/ssbump", "'" + key + "' is not known; use file, convention, hand or texCoord");
    }
  }
  auto file = resolveReference(document_.folder, ssbump.Get("file").Get<std::string>(), document_.options);
  if (!file) return document_.error(place + "/ssbump/file", file.error().message);
  if (auto set = setSsbumpMap(scene_, material, *file); !set)
    return document_.error(place + "/ssbump/file", set.error().message);
  if (uvSet) material.ssbumpMap.uvSet = *uvSet;
  return {};
}

Expected<void> MaterialLoader::run() {
  for (const auto& source : document_.model.materials) scene_.materials.push_back(convert(source));
  const auto& meshes = document_.model.meshes;
  const bool needsDefault = std::any_of(meshes.begin(), meshes.end(), [](const auto& mesh) {
    return std::any_of(mesh.primitives.begin(), mesh.primitives.end(), [](const auto& p) { return p.material < 0; });
  });
  if (needsDefault || scene_.materials.empty()) scene_.materials.push_back(defaultMaterial());
  for (const std::size_t index : wanted_) {
    if (index == kNoImage) {
      scene_.images.push_back({.name = "no image", .mimeType = "", .encoded = {}});
      continue;
    }
    auto source = load(document_.images[index], index);
    if (!source) return source.error();
    scene_.images.push_back(*std::move(source));
  }
  for (std::size_t i = 0; i < document_.model.materials.size(); ++i)
    if (auto read = readSsbump(document_.model.materials[i], i); !read) return read;
  return {};
}

}  // namespace

Expected<void> loadMaterials(const GltfDocument& document, Scene& scene) {
  return MaterialLoader(document, scene).run();
}

}  // namespace lumel
