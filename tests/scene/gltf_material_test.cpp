#include <gtest/gtest.h>

#include "scene/images/texture.h"
#include "tests/mentions.h"
#include "tests/scene/gltf_builder.h"

namespace lumel {
namespace {

using Json = nlohmann::json;

// 2 x 2 texels, lossless: red green / blue white.
constexpr const char* kPng =
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAACCAIAAAD91JpzAAAAFklEQVR4nGP4z8DA8J+BkYHh////DAAe9gT9Ce00PgAA"
    "AABJRU5ErkJggg==";
constexpr const char* kWebp =
    "data:image/webp;base64,UklGRiwAAABXRUJQVlA4TB8AAAAvAUAAAB8gEEjeHzqN+RcQFPwf3fxHZA/gBgwR/Q8BAA==";

GltfBuilder textured(const Json& material) {
  GltfBuilder g;
  g.square()["material"] = 0;
  g.json["images"] = {{{"uri", kPng}}, {{"uri", kWebp}}};
  g.json["textures"] = {{{"source", 0}},
                        {{"source", 0}, {"sampler", 0}, {"extensions", {{"EXT_texture_webp", {{"source", 1}}}}}}};
  g.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
  g.json["materials"] = {material};
  return g;
}

TEST(GltfMaterial, DefaultsAreThoseOfTheSpecification) {
  auto g = textured(Json::object());
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.materials.size(), 1u);
  const Material& m = scene.materials[0];
  EXPECT_EQ(m.baseColor, Vec4(1));
  EXPECT_EQ(m.metallic, 1);
  EXPECT_EQ(m.roughness, 1);
  EXPECT_EQ(m.emission, Vec3(0));
  EXPECT_EQ(m.alphaMode, AlphaMode::Opaque);
  EXPECT_EQ(m.alphaCutoff, 0.5f);
  EXPECT_FALSE(m.doubleSided || m.unlit || m.baseColorMap || m.normalMap || m.emissionMap);
  EXPECT_TRUE(scene.images.empty());  // no material reads one
}

TEST(GltfMaterial, EveryMemberIsRead) {
  auto g = textured(
      {{"name", "Neon"},
       {"pbrMetallicRoughness",
        {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}},
         {"baseColorTexture", {{"index", 0}, {"texCoord", 1}}},
         {"metallicFactor", 0.25},
         {"roughnessFactor", 0.75},
         {"metallicRoughnessTexture", {{"index", 0}}}}},
       {"normalTexture", {{"index", 0}, {"scale", 0.5}}},
       {"emissiveFactor", {1, 0.5, 0}},
       {"emissiveTexture", {{"index", 0}}},
       {"alphaMode", "MASK"},
       {"alphaCutoff", 0.3},
       {"doubleSided", true},
       {"extensions",
        {{"KHR_materials_emissive_strength", {{"emissiveStrength", 40}}}, {"KHR_materials_unlit", Json::object()}}}});
  LOAD_OR_FAIL(scene, g.load());
  const Material& m = scene.materials[0];
  EXPECT_EQ(m.name, "Neon");
  EXPECT_EQ(m.baseColor, Vec4(0.1f, 0.2f, 0.3f, 0.4f));
  EXPECT_EQ(m.baseColorMap.uvSet, 1);
  EXPECT_EQ(m.metallic, 0.25f);
  EXPECT_EQ(m.roughness, 0.75f);
  EXPECT_TRUE(m.metallicRoughnessMap && m.normalMap && m.emissionMap);
  EXPECT_EQ(m.normalScale, 0.5f);
  EXPECT_EQ(m.emission, Vec3(40, 20, 0));
  EXPECT_EQ(m.alphaMode, AlphaMode::Mask);
  EXPECT_EQ(m.alphaCutoff, 0.3f);
  EXPECT_TRUE(m.doubleSided && m.unlit);
  ASSERT_EQ(scene.images.size(), 1u);  // one image, read by four textures
  EXPECT_EQ(scene.images[0].mimeType, "image/png");
  EXPECT_FALSE(scene.primitive(0, 0).tangents.empty());  // there is a normal map
}

TEST(GltfMaterial, WebpAndSamplers) {
  auto g = textured({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 1}}}}}});
  g.json["extensionsRequired"] = {"EXT_texture_webp"};
  LOAD_OR_FAIL(scene, g.load());
  const TextureRef& ref = scene.materials[0].baseColorMap;
  EXPECT_EQ(scene.images[static_cast<std::size_t>(ref.image)].mimeType, "image/webp");
  EXPECT_EQ(ref.wrapU, Wrap::Clamp);
  EXPECT_EQ(ref.wrapV, Wrap::Mirror);
  EXPECT_TRUE(ref.nearest);
  auto texture = Texture::decode(scene.images[0], ColorSpace::Srgb);
  ASSERT_TRUE(texture) << texture.error().message;
  EXPECT_EQ(texture->fetch(1, 0), Vec4(0, 1, 0, 1));
  EXPECT_EQ(texture->fetch(0, 1), Vec4(0, 0, 1, 1));
}

TEST(GltfMaterial, TextureTransformScalesTurnsAndShifts) {
  const double quarter = std::acos(0.0);
  auto g =
      textured({{"pbrMetallicRoughness",
                 {{"baseColorTexture",
                   {{"index", 0},
                    {"texCoord", 0},
                    {"extensions",
                     {{"KHR_texture_transform",
                       {{"offset", {0.5, 0.25}}, {"rotation", quarter}, {"scale", {2, 3}}, {"texCoord", 1}}}}}}}}}});
  g.json["extensionsRequired"] = {"KHR_texture_transform"};
  LOAD_OR_FAIL(scene, g.load());
  const TextureRef& ref = scene.materials[0].baseColorMap;
  EXPECT_EQ(ref.uvSet, 1);
  // Scaled to (2, 0) and (0, 3), then turned counter-clockwise as the image is seen: right goes up (-v), down right.
  const Vec3 u = ref.uvMatrix * Vec3(1, 0, 1), v = ref.uvMatrix * Vec3(0, 1, 1);
  EXPECT_NEAR(u.x, 0.5, 1e-6);
  EXPECT_NEAR(u.y, 0.25 - 2, 1e-6);
  EXPECT_NEAR(v.x, 0.5 + 3, 1e-6);
  EXPECT_NEAR(v.y, 0.25, 1e-6);
}

TEST(GltfMaterial, PrimitivesWithoutMaterialGetADefaultAfterTheOthers) {
  auto g = textured({{"name", "Given"}});
  g.json["meshes"][0]["primitives"].push_back(g.json["meshes"][0]["primitives"][0]);
  g.json["meshes"][0]["primitives"][1].erase("material");
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.materials.size(), 2u);
  EXPECT_EQ(scene.primitive(0, 0).material, 0);
  EXPECT_EQ(scene.primitive(0, 1).material, 1);
  EXPECT_EQ(scene.materials[1].name, "default");
  EXPECT_EQ(scene.materials[1].baseColor, Vec4(0.8f, 0.8f, 0.8f, 1));
}

TEST(GltfMaterial, SpecularGlossinessGivesItsDiffuseColour) {
  auto g = textured({{"extensions",
                      {{"KHR_materials_pbrSpecularGlossiness",
                        {{"diffuseFactor", {0.5, 0.25, 0.125, 1}}, {"diffuseTexture", {{"index", 0}}}}}}}});
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_EQ(scene.materials[0].baseColor, Vec4(0.5f, 0.25f, 0.125f, 1));
  EXPECT_TRUE(scene.materials[0].baseColorMap);
}

TEST(GltfMaterial, SpecularGlossinessTakesThePlaceOfItsFallback) {
  auto g = textured({{"pbrMetallicRoughness",
                      {{"baseColorFactor", {1, 0, 0, 1}}, {"metallicFactor", 1}, {"baseColorTexture", {{"index", 0}}}}},
                     {"extensions", {{"KHR_materials_pbrSpecularGlossiness", {{"glossinessFactor", 0.3}}}}}});
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_EQ(scene.materials[0].baseColor, Vec4(1.0f));
  EXPECT_FALSE(scene.materials[0].baseColorMap);
  EXPECT_EQ(scene.materials[0].metallic, 0.0f);
}

TEST(GltfMaterial, ImagesInBufferViewsAndTexturesWithoutASource) {
  auto g =
      textured({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}, {"emissiveTexture", {{"index", 1}}}});
  const unsigned char jpegStart[] = {0xFF, 0xD8, 0xFF, 0xE0};
  const int view = g.view(jpegStart, 4);
  g.json["images"][0] = {{"bufferView", view}, {"mimeType", "image/png"}};
  g.json["textures"][1] = Json::object();
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_EQ(scene.images[0].mimeType, "image/jpeg");  // by content, whatever the file says
  EXPECT_EQ(scene.images[0].name, "image 0");
  // loadScene makes black emission of it.
  ASSERT_TRUE(scene.materials[0].emissionMap);
  EXPECT_TRUE(scene.images[static_cast<std::size_t>(scene.materials[0].emissionMap.image)].encoded.empty());
  ASSERT_EQ(scene.report.warnings.size(), 1u);
  EXPECT_TRUE(mentions(scene.report.warnings[0], "textures/1: has no image"));
}

TEST(GltfMaterial, WrongMembersAreNamed) {
  const auto message = [](const Json& material) {
    auto result = textured(material).load();
    return result ? std::string("(it loads)") : result.error().message;
  };
  EXPECT_EQ(message({{"alphaMode", "GLASS"}}), "test.glb: materials/0: alphaMode 'GLASS' is not OPAQUE, MASK or BLEND");
  EXPECT_EQ(message({{"normalTexture", {{"index", 7}}}}),
            "test.glb: materials/0/normalTexture/index: is 7, but there are 2 textures");
  EXPECT_EQ(message({{"emissiveFactor", {1, 2}}}), "test.glb: materials/0/emissiveFactor: must have 3 numbers");
  EXPECT_EQ(message({{"pbrMetallicRoughness", {{"baseColorFactor", {1, 2, "x", 4}}}}}),
            "test.glb: materials/0/pbrMetallicRoughness/baseColorFactor/2: must be a number that a float can hold");
  EXPECT_EQ(
      message({{"emissiveTexture", {{"index", 0}, {"extensions", {{"KHR_texture_transform", {{"scale", 2}}}}}}}}),
      "test.glb: materials/0/emissiveTexture/extensions/KHR_texture_transform/scale: must be an array of numbers");
}

}  // namespace
}  // namespace lumel
