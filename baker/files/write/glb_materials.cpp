#include "baker/files/write/glb_materials.h"

#include <map>
#include <tuple>

#include "baker/files/names/file_names.h"
#include "scene/images/image_io.h"
#include "scene/images/image_type.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

// Sampler constants of the glTF 2.0 specification.
constexpr int kNearest = 9728;
constexpr int kLinear = 9729;
constexpr int kNearestMipmapNearest = 9984;
constexpr int kLinearMipmapLinear = 9987;
constexpr int kRepeat = 10497;
constexpr int kClampToEdge = 33071;
constexpr int kMirroredRepeat = 33648;

int wrapConstant(Wrap wrap) {
  return wrap == Wrap::Clamp ? kClampToEdge : wrap == Wrap::Mirror ? kMirroredRepeat : kRepeat;
}

/// Whether a GLB may hold images of this type (glTF 2.0, EXT_texture_webp).
bool isGlbImageType(const std::string& mimeType) {
  return mimeType == "image/png" || mimeType == "image/jpeg" || mimeType == "image/webp";
}

class MaterialWriter {
 public:
  MaterialWriter(const Scene& scene, GlbBuffer& buffer) : scene_(scene), buffer_(buffer) {}

  Expected<GlbMaterials> write() {
    for (const Material& material : scene_.materials) out_.materials.push_back(describe(material));
    if (failed_) return *failed_;
    return std::move(out_);
  }

 private:
  Json describe(const Material& m) {
    Json json;
    if (!m.name.empty()) json["name"] = m.name;
    Json pbr = {{"baseColorFactor", {m.baseColor.x, m.baseColor.y, m.baseColor.z, m.baseColor.w}},
                {"metallicFactor", m.metallic},
                {"roughnessFactor", m.roughness}};
    addTexture(pbr, "baseColorTexture", m.baseColorMap);
    addTexture(pbr, "metallicRoughnessTexture", m.metallicRoughnessMap);
    json["pbrMetallicRoughness"] = std::move(pbr);
    if (addTexture(json, "normalTexture", m.normalMap) && m.normalScale != 1.0f)
      json["normalTexture"]["scale"] = m.normalScale;
    if (addTexture(json, "occlusionTexture", m.occlusionMap) && m.occlusionStrength != 1.0f)
      json["occlusionTexture"]["strength"] = m.occlusionStrength;
    addEmission(json, m);
    addSsbump(json, m);
    if (m.alphaMode == AlphaMode::Mask) {
      json["alphaMode"] = "MASK";
      json["alphaCutoff"] = m.alphaCutoff;
    } else if (m.alphaMode == AlphaMode::Blend) {
      json["alphaMode"] = "BLEND";
    }
    if (m.doubleSided) json["doubleSided"] = true;
    if (m.transmission > 0.0f) {
      json["extensions"]["KHR_materials_transmission"] = {{"transmissionFactor", m.transmission}};
      out_.extensionsUsed.insert("KHR_materials_transmission");
    }
    if (m.unlit) {
      json["extensions"]["KHR_materials_unlit"] = Json::object();
      out_.extensionsUsed.insert("KHR_materials_unlit");
    }
    return json;
  }

  void addEmission(Json& json, const Material& m) {
    const float peak = std::max({m.emission.x, m.emission.y, m.emission.z});
    if (!(peak > 0.0f)) return;
    // Factors end at 1; what is brighter goes into the strength.
    const float strength = std::max(peak, 1.0f);
    const Vec3 factor = m.emission / strength;
    json["emissiveFactor"] = {factor.x, factor.y, factor.z};
    addTexture(json, "emissiveTexture", m.emissionMap);
    if (strength == 1.0f) return;
    json["extensions"]["KHR_materials_emissive_strength"] = {{"emissiveStrength", strength}};
    out_.extensionsUsed.insert("KHR_materials_emissive_strength");
  }

  /// A file beside scene.glb: GLB images are PNG and JPEG, without the metadata and the floats of ssbump maps.
  void addSsbump(Json& json, const Material& m) {
    if (!m.ssbumpMap) return;
    Json ssbump = {{"file", ssbumpFileName(m.ssbumpMap.image,
                                           scene_.images[static_cast<std::size_t>(m.ssbumpMap.image)].mimeType)}};
    if (!m.ssbumpForm.empty()) ssbump["convention"] = m.ssbumpForm;
    if (!m.ssbumpHand.empty()) ssbump["hand"] = m.ssbumpHand;
    if (m.ssbumpMap.uvSet != 0) ssbump["texCoord"] = writtenUvSet(m.ssbumpMap.uvSet);
    json["extras"]["lumel"]["ssbump"] = std::move(ssbump);
  }

  bool addTexture(Json& parent, const char* key, const TextureRef& ref) {
    if (!ref) return false;
    const int texture = textureIndex(ref);
    if (texture < 0) return false;
    Json json = {{"index", texture}};
    if (ref.uvSet != 0) json["texCoord"] = writtenUvSet(ref.uvSet);
    if (ref.uvMatrix != Mat3(1.0f)) {
      json["extensions"]["KHR_texture_transform"] = describeTransform(ref.uvMatrix);
      out_.extensionsUsed.insert("KHR_texture_transform");
      out_.extensionsRequired.insert("KHR_texture_transform");
    }
    parent[key] = std::move(json);
    return true;
  }

  /// Inverse of the product translation * rotation * scale that KHR_texture_transform defines; uvMatrix is such a
  /// product, so it has no shear.
  static Json describeTransform(const Mat3& m) {
    const float scaleU = std::hypot(m[0][0], m[0][1]);
    const float determinant = m[0][0] * m[1][1] - m[1][0] * m[0][1];
    const float scaleV = scaleU > 0.0f ? determinant / scaleU : std::hypot(m[1][0], m[1][1]);
    // The extension counts the angle clockwise in the (u right, v up) plane of its matrix: column 0 is
    // scaleU * (cos, -sin).
    const float rotation = scaleU > 0.0f ? std::atan2(-m[0][1], m[0][0]) : std::atan2(m[1][0], m[1][1]);
    Json json = Json::object();
    if (m[2][0] != 0.0f || m[2][1] != 0.0f) json["offset"] = {m[2][0], m[2][1]};
    if (rotation != 0.0f) json["rotation"] = rotation;
    if (scaleU != 1.0f || scaleV != 1.0f) json["scale"] = {scaleU, scaleV};
    return json;
  }

  int textureIndex(const TextureRef& ref) {
    const int image = imageIndex(ref.image);
    if (image < 0) return -1;
    const auto key = std::make_tuple(image, wrapConstant(ref.wrapU), wrapConstant(ref.wrapV), ref.nearest);
    if (const auto known = textures_.find(key); known != textures_.end()) return known->second;
    Json texture = {{"sampler", samplerIndex(ref)}};
    if (out_.images[static_cast<std::size_t>(image)]["mimeType"] == "image/webp") {
      texture["extensions"]["EXT_texture_webp"] = {{"source", image}};
      out_.extensionsUsed.insert("EXT_texture_webp");
      out_.extensionsRequired.insert("EXT_texture_webp");
    } else {
      texture["source"] = image;
    }
    out_.textures.push_back(std::move(texture));
    return textures_[key] = static_cast<int>(out_.textures.size()) - 1;
  }

  int samplerIndex(const TextureRef& ref) {
    Json sampler = {{"magFilter", ref.nearest ? kNearest : kLinear},
                    {"minFilter", ref.nearest ? kNearestMipmapNearest : kLinearMipmapLinear},
                    {"wrapS", wrapConstant(ref.wrapU)},
                    {"wrapT", wrapConstant(ref.wrapV)}};
    for (std::size_t i = 0; i < out_.samplers.size(); ++i)
      if (out_.samplers[i] == sampler) return static_cast<int>(i);
    out_.samplers.push_back(std::move(sampler));
    return static_cast<int>(out_.samplers.size()) - 1;
  }

  int imageIndex(int source) {
    if (const auto known = images_.find(source); known != images_.end()) return known->second;
    return images_[source] = addImage(scene_.images[static_cast<std::size_t>(source)]);
  }

  int addImage(const ImageSource& image) {
    if (image.encoded.empty()) return -1;
    std::string mimeType = imageMimeType(image.encoded);
    int view = -1;
    if (isGlbImageType(mimeType)) {
      view = buffer_.addBytes(image.encoded);
    } else {
      const auto decoded = readImage(image.encoded, image.name);
      if (!decoded) return -1;
      const auto png = encodePng(decoded->image);
      if (!png) {
        failed_ = failure("scene.glb: image '" + image.name + "': " + png.error().message);
        return -1;
      }
      mimeType = "image/png";
      view = buffer_.addBytes(*png);
    }
    Json json = {{"bufferView", view}, {"mimeType", mimeType}};
    if (!image.name.empty()) json["name"] = image.name;
    out_.images.push_back(std::move(json));
    return static_cast<int>(out_.images.size()) - 1;
  }

  const Scene& scene_;
  GlbBuffer& buffer_;
  GlbMaterials out_;
  std::map<std::tuple<int, int, int, bool>, int> textures_;
  std::map<int, int> images_;
  std::optional<Error> failed_;
};

}  // namespace

Expected<GlbMaterials> describeMaterials(const Scene& scene, GlbBuffer& buffer) {
  return MaterialWriter(scene, buffer).write();
}

}  // namespace lumel
