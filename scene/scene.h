// The scene as plain data: what every other room works on. Units: metres, candela, lux, nits (no photometric factor
// anywhere: a lux in is a lux out). Right-handed, y up, as glTF.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/base/math.h"
#include "scene/image.h"
#include "scene/light.h"
#include "scene/volume.h"

namespace lumel {

/// Largest coordinate that loaders let through, in metres: squares of larger distances overflow a float.
inline constexpr float kMaxCoordinate = 1e18f;

/// Where an object's lightmap lies in the atlas of a baked scene: page UV = TEXCOORD_1 * scale + offset.
struct LightmapPlace {
  int page = -1;  // -1: none for the object as a whole
  Vec2 scale{1.0f};
  Vec2 offset{0.0f};

  Vec2 apply(Vec2 uv) const { return Vec2(Vec2d(uv) * Vec2d(scale) + Vec2d(offset)); }
};

/// A triangle list. Every array but `indices` has one entry per vertex or is empty.
struct Primitive {
  std::string name;  // for messages: "mesh 'Wall' primitive 2"
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;              // unit; always present after loading (flat where the file had none)
  std::vector<Vec4> tangents;             // xyz unit, w = +-1: bitangent = w * cross(n, t); from the file or made from
                                          // the normal or ssbump map's UVs; empty where neither asks for them
  std::vector<std::vector<Vec2>> uvSets;  // TEXCOORD_n; v runs down the image
  std::vector<Vec4> colors;               // COLOR_0, linear, alpha 1 where the file has RGB
  std::vector<std::uint32_t> indices;     // three per triangle, counter-clockwise from the front
  int material = 0;                       // into Scene::materials; always valid
  int lightmapPage = -1;                  // extras.lumel.page of the primitive: its lightmap, on TEXCOORD_1; -1 = as
                                          // its instance says

  std::size_t triangleCount() const { return indices.size() / 3; }
};

struct Mesh {
  std::string name;
  std::vector<Primitive> primitives;
};

/// Holds what extras.lumel of a glTF node (or its mesh) says: {"scale": 2.0, "casts": false, "receives": false}.
struct ObjectSettings {
  float texelDensityScale = 1.0f;  // multiplies the bake's texels per metre; > 0
  bool casts = true;               // blocks and bounces light for others
  bool receives = true;            // gets a lightmap
};

/// One placed mesh; the node tree (and EXT_mesh_gpu_instancing) is flattened into these, in file order.
struct Instance {
  std::string name;  // of the node; never empty, not always unique
  int mesh = 0;
  Mat4 worldFromObject{1.0f};  // may mirror (negative determinant)
  ObjectSettings settings{};
  LightmapPlace lightmap{};  // extras.lumel.page, scale and offset of the node of a baked scene

  /// The page of a primitive's lightmap; -1: it has none.
  int lightmapPageOf(const Primitive& primitive) const {
    return primitive.lightmapPage < 0 ? lightmap.page : primitive.lightmapPage;
  }
};

enum class Wrap { Repeat, Mirror, Clamp };

/// Tells where and how a material reads an image. uv' = uvMatrix * (u, v, 1) (KHR_texture_transform).
struct TextureRef {
  int image = -1;  // into Scene::images; -1 = none
  int uvSet = 0;
  Mat3 uvMatrix{1.0f};
  Wrap wrapU = Wrap::Repeat;
  Wrap wrapV = Wrap::Repeat;
  bool nearest = false;  // magnification filter NEAREST

  explicit operator bool() const { return image >= 0; }
};

enum class AlphaMode { Opaque, Mask, Blend };

/// Light transport is Lambertian with the base colour as albedo (a lightmap holds no specular light, and a metal
/// whose diffuse part were black would leave a hole in the bounce light). Metallic and roughness are only carried
/// through to scene.glb.
struct Material {
  std::string name;
  Vec4 baseColor{1, 1, 1, 1};  // linear factor; alpha in w
  TextureRef baseColorMap;     // sRGB colour, linear alpha
  float metallic = 0.0f;
  float roughness = 1.0f;
  TextureRef metallicRoughnessMap;
  TextureRef normalMap;  // tangent space, green up
  float normalScale = 1.0f;
  TextureRef occlusionMap;  // red channel: share of the even light around that reaches a point
  float occlusionStrength = 1.0f;
  TextureRef ssbumpMap;    // self-shadowed bump map (extras.lumel.ssbump), whose channels are as these say:
  std::string ssbumpForm;  // "squared", "linear" or "mod2x"; empty: not stated
  std::string ssbumpHand;  // "right" or "left"; empty: not stated
  Vec3 emission{0, 0, 0};  // nits: emissiveFactor * emissiveStrength
  TextureRef emissionMap;  // sRGB, times `emission`
  AlphaMode alphaMode = AlphaMode::Opaque;
  float alphaCutoff = 0.5f;
  bool doubleSided = false;
  float transmission = 0.0f;  // KHR_materials_transmission: share of light that passes, times the base colour; the
                              // surface is thin, light goes straight on
  bool unlit = false;         // KHR_materials_unlit: shown as it is, gets no lightmap, reflects as a diffuse surface
};

/// An image as the file holds it, decoded only when something needs its pixels (decodeTexture).
struct ImageSource {
  std::string name;                   // for messages: file name or "image 3"
  std::string mimeType;               // "image/png", "image/jpeg", "image/webp", ... ; empty if unknown
  std::vector<std::uint8_t> encoded;  // empty: missing (a warning was given)
};

/// Stands for a base colour map that is missing or cannot be decoded, and is multiplied with its factor: between the
/// 0.5 of usual colour maps and the 0.8 of surfaces without a material. The factor alone is often white, and a closed
/// level of albedo 1 is a furnace. An emission map that is missing counts as black.
inline constexpr float kMissingColor = 0.6f;

struct Camera {
  std::string name;
  Mat4 worldFromCamera{1.0f};  // looks along -z, y up
  bool orthographic = false;
  float yFov = 0.8f;     // radians; perspective
  float aspect = 0.0f;   // width / height; 0 = that of the picture
  float yExtent = 1.0f;  // half height in metres; orthographic
};

/// Light from infinity. Radiance = strength * (image or color). The image is equirectangular; with rotation 0,
/// direction d reads u = 0.5 + atan2(d.z, d.x) / 2pi, v (from the top) = 0.5 - asin(d.y) / pi.
struct Environment {
  Vec3 color{0, 0, 0};
  Image image;                   // linear RGB; empty: `color` everywhere
  float rotationDegrees = 0.0f;  // turns the sky about +y, counter-clockwise seen from above
  float strength = 1.0f;

  bool isBlack() const { return strength == 0.0f || (image.empty() && color == Vec3(0.0f)); }
};

/// What loading met that the user may want to know.
struct LoadReport {
  std::vector<std::string> warnings;    // one line each
  std::vector<std::string> notes;       // one line each: what was taken for granted, and how to overrule it
  std::size_t degenerateTriangles = 0;  // dropped: zero area or repeated vertices
  std::size_t skippedPrimitives = 0;    // points and lines
};

/// What a surface without a material is made of: grey, since white without end would drown a closed level in light.
inline Material defaultMaterial() {
  Material material;
  material.name = "default";
  material.baseColor = {0.8f, 0.8f, 0.8f, 1.0f};
  return material;
}

struct Scene {
  std::vector<Mesh> meshes;
  std::vector<Instance> instances;
  std::vector<Material> materials;  // at least one
  std::vector<ImageSource> images;
  std::vector<Light> lights;
  std::vector<Camera> cameras;
  std::vector<VolumeBox> volumes;
  Environment environment;  // set by the command line, not by the file
  LoadReport report;

  const Primitive& primitive(int mesh, int index) const {
    return meshes[static_cast<std::size_t>(mesh)].primitives[static_cast<std::size_t>(index)];
  }
};

}  // namespace lumel
