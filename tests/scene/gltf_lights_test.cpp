// Lamps as modelling tools export them: units, area lights, settings in extras.lumel.light, IES files.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "scene/ies/ies_file.h"
#include "tests/scene/gltf_samples.h"

namespace lumel {
namespace {

using Json = nlohmann::json;
constexpr double kSphere = 4.0 * std::numbers::pi;
constexpr const char* kBlender = "Khronos glTF Blender I/O v3.4.50";

Expected<Scene> loadWith(const GltfBuilder& g, LightUnits units) {
  return loadGltf(g.glb(), "test.glb", {}, {.lightUnits = units});
}

/// A point of so many candela and a sun of so many lux.
GltfBuilder lampAndSun(double candela, double lux, const char* generator) {
  GltfBuilder g;
  g.json["asset"]["generator"] = generator;
  g.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", candela}},
                                                           {{"type", "directional"}, {"intensity", lux}}};
  for (int i = 0; i < 2; ++i) g.add("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
  return g;
}

struct Units {
  double candela, lux;
  std::size_t notes;
};
Units unitsOf(double candela, double lux, const char* generator, LightUnits asked = LightUnits::Auto) {
  const auto scene = loadWith(lampAndSun(candela, lux, generator), asked);
  if (!scene) return {};
  return {static_cast<double>(scene->lights[0].intensity), static_cast<double>(scene->lights[1].intensity),
          scene->report.notes.size()};
}

// 100 W and 3 W/m^2 in Blender, written in each of its exporter's lighting modes, are 100 / 4 pi and 3.
TEST(LightUnits, BlendersModesGiveItsWatts) {
  const double want = 100 / kSphere;
  const auto expect = [&](const Units& units, std::size_t notes) {
    EXPECT_NEAR(units.candela, want, 1e-5 * want);
    EXPECT_NEAR(units.lux, 3.0, 3e-5);
    EXPECT_EQ(units.notes, notes);
  };
  expect(unitsOf(want * 683, 3 * 683, kBlender), 1);
  expect(unitsOf(want, 3, kBlender), 1);
  expect(unitsOf(100, 3, "Khronos glTF Blender I/O v3.2.40"), 1);
  expect(unitsOf(want * 683, 3 * 683, kBlender, LightUnits::Blender), 0);
  expect(unitsOf(want, 3, kBlender, LightUnits::Gltf), 0);
  expect(unitsOf(100, 3, kBlender, LightUnits::BlenderRaw), 0);
  // Powers that are round in no mode, or in several, are those of the default.
  EXPECT_NEAR(unitsOf(12.3456789, 1.23456789, kBlender).candela, 12.3456789 / 683, 1e-6);
}

TEST(LightUnits, OtherProgramsMeanWhatTheyWrite) {
  for (const char* generator : {"", "level editor 1.0", "Khronos Blender glTF 2.0 exporter"}) {
    const Units units = unitsOf(54.35, 2049, generator);
    EXPECT_NEAR(units.candela, 54.35, 1e-5);
    EXPECT_EQ(units.lux, 2049);
    EXPECT_EQ(units.notes, 0u);
  }
}

TEST(LightUnits, SurfacesThatShineAreNotScaled) {
  GltfBuilder g = lampAndSun(683, 683, kBlender);
  g.square()["material"] = g.add("materials", {{"emissiveFactor", {1, 1, 1}}});
  LOAD_OR_FAIL(scene, loadWith(g, LightUnits::Blender));
  EXPECT_EQ(scene.materials[0].emission, Vec3(1.0f));
}

TEST(AreaNodes, AreReportedOnce) {
  GltfBuilder g;
  g.add("nodes", {{"name", "Area"}});
  g.add("nodes", {{"name", "Light"}, {"extras", {{"type", "AREA"}, {"energy", 100.0}}}});
  g.add("nodes", {{"name", "spawn_area"}});
  g.add("nodes",
        {{"name", "Area.001"}, {"extras", {{"lumel", {{"light", {{"type", "disc"}, {"radius", 1}, {"watts", 5}}}}}}}});
  LOAD_OR_FAIL(scene, g.load());
  ASSERT_EQ(scene.report.warnings.size(), 1u);
  EXPECT_NE(scene.report.warnings[0].find("no light, because glTF has none: 'Area', 'Light'; give them"),
            std::string::npos)
      << scene.report.warnings[0];
  EXPECT_EQ(scene.lights.size(), 1u);
}

/// The light of a node with these settings; it stands at (1, 2, 3), turned so that -z points down, and scaled by 2.
struct LightOf {
  Expected<Scene> scene;
  LightOf(const Json& lumel, const char* type = nullptr) : scene(load(lumel, type)) {}
  static Expected<Scene> load(const Json& lumel, const char* type) {
    GltfBuilder g;
    const double h = std::sqrt(0.5);
    Json node = {{"name", "Lamp"}, {"translation", {1, 2, 3}}, {"rotation", {-h, 0, 0, h}}, {"scale", {2, 2, 2}}};
    node["extras"]["lumel"] = lumel;
    if (type != nullptr) {
      g.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", type}, {"intensity", 5}}};
      node["extensions"]["KHR_lights_punctual"]["light"] = 0;
    }
    g.add("nodes", node);
    return g.load();
  }
  std::string error() const { return scene ? "" : scene.error().message; }
  const Light& light() const { return scene->lights.at(0); }
};

TEST(LightSettings, PanelsAndSpheres) {
  const LightOf rectangle({{"light", {{"type", "rectangle"}, {"size", {1, 0.5}}, {"watts", 6}, {"color", {1, 0, 0}}}}},
                          nullptr);
  ASSERT_EQ(rectangle.error(), "");
  const Light& r = rectangle.light();
  EXPECT_EQ(r.type, LightType::Rectangle);
  EXPECT_EQ(r.name, "Lamp");
  EXPECT_NEAR(r.size.x, 2.0f, 1e-5f);  // sizes scale with the node
  EXPECT_NEAR(r.size.y, 1.0f, 1e-5f);
  EXPECT_NEAR(r.intensity, 6.0f / (kPi * 2.0f), 1e-5f);  // a panel sends pi L A
  EXPECT_NEAR(glm::length(r.direction - Vec3(0, -1, 0)), 0.0f, 1e-6f);
  EXPECT_EQ(r.position, Vec3(1, 2, 3));
  EXPECT_EQ(r.color, Vec3(1, 0, 0));
  const LightOf disc({{"light", {{"type", "disc"}, {"radius", 0.5}, {"nits", 3}}}}, nullptr);
  ASSERT_EQ(disc.error(), "");
  EXPECT_NEAR(disc.light().radius, 1.0f, 1e-5f);
  EXPECT_EQ(disc.light().intensity, 3.0f);
  const LightOf sphere({{"light", {{"type", "sphere"}, {"radius", 0.5}, {"lumens", 12}}}}, nullptr);
  ASSERT_EQ(sphere.error(), "");
  EXPECT_NEAR(sphere.light().intensity, 12.0f / (4 * kPi), 1e-5f);
}

TEST(LightSettings, BesideALightOfTheFormat) {
  const LightOf point({{"light", {{"radius", 0.1}, {"mode", "indirect"}, {"shadow_mask", 1}}}}, "point");
  ASSERT_EQ(point.error(), "");
  EXPECT_EQ(point.light().radius, 0.1f);
  EXPECT_EQ(point.light().intensity, 5.0f);
  EXPECT_EQ(point.light().mode, LightMode::Indirect);
  EXPECT_TRUE(point.light().hasShadowMask);
  const LightOf sun({{"light", {{"angle", 0.53}, {"mode", "none"}}}}, "directional");
  ASSERT_EQ(sun.error(), "");
  EXPECT_NEAR(sun.light().halfAngle, 0.53f * kPi / 360, 1e-7f);
  EXPECT_EQ(sun.light().mode, LightMode::None);
}

// As modelling tools write custom properties.
TEST(LightSettings, TextThatHoldsJson) {
  for (const Json& lumel : {Json(R"({"light": {"type": "rectangle", "size": [1, 1], "nits": 2}})"),
                            Json({{"light", R"({"type": "rectangle", "size": [1, 1], "nits": 2})"}}),
                            Json({{"light", {{"type", "rectangle"}, {"size", "[1, 1]"}, {"nits", 2}}}})}) {
    const LightOf light(lumel);
    ASSERT_EQ(light.error(), "") << lumel;
    EXPECT_EQ(light.light().intensity, 2.0f);
  }
  GltfBuilder g;
  g.square();
  g.json["nodes"][0]["extras"]["lumel"] = R"({"casts": 0, "receives": 1.0})";
  LOAD_OR_FAIL(scene, g.load());
  EXPECT_FALSE(scene.instances[0].settings.casts);
  EXPECT_TRUE(scene.instances[0].settings.receives);
}

TEST(LightSettings, BadValuesNameNodeAndProperty) {
  const std::string place = "test.glb: nodes/0 'Lamp': extras.lumel.light: ";
  const auto expect = [&](const Json& light, const char* type, const std::string& problem) {
    EXPECT_EQ(LightOf({{"light", light}}, type).error(), place + problem);
  };
  expect({{"radius", -1}}, "point", "radius must be a number of metres, 0 or more");
  expect({{"angle", 200}}, "directional", "angle must be a number of degrees, from 0 to 90");
  expect({{"angle", 1}}, "point", "angle is for directional lights; give a radius");
  expect({{"radius", 1}}, "directional", "radius is for points and spots; give an angle in degrees");
  expect({{"type", "box"}}, nullptr, "type must be \"rectangle\", \"disc\" or \"sphere\"");
  expect({{"type", "disc"}, {"watts", 1}}, nullptr, "a disc needs a radius above 0");
  expect({{"type", "rectangle"}, {"size", {1, 0}}, {"watts", 1}}, nullptr,
         "size must be two numbers of metres above 0, [WIDTH, HEIGHT]");
  expect({{"type", "disc"}, {"radius", 1}}, nullptr, "give one of watts, lumens and nits, which say how bright it is");
  expect({{"radius", 1}}, nullptr,
         "the node has no light of KHR_lights_punctual; give a type, \"rectangle\", \"disc\" or \"sphere\"");
  expect({{"mode", "off"}}, "point", "mode must be \"all\", \"indirect\" or \"none\"");
  expect({{"shadow_mask", 2}}, "point", "shadow_mask must be true or false");
  expect("{not JSON", "point", "must be an object such as {\"radius\": 0.1}");
  expect({{"ies", "../lamp.ies"}}, "directional", "ies is for points, spots and spheres");
  const std::string outside = LightOf({{"light", {{"ies", "../lamp.ies"}}}}, "point").error();
  EXPECT_EQ(outside.rfind(place + "ies: ", 0), 0u) << outside;
  const std::string unknown = LightOf({{"light", {{"radios", 1}}}}, "point").error();
  EXPECT_EQ(unknown.rfind(place + "'radios' is not known", 0), 0u) << unknown;
}

std::string iesOf(const std::string& head, const std::string& rest) {
  return "IESNA:LM-63-2002\n[TEST] x\n" + head + "\n" + rest;
}

TEST(Ies, SymmetriesAreWrittenOut) {
  // Quadrant symmetry: C = 0 and 90 stand for 180 and 270.
  const auto quadrant = parseIes(iesOf("TILT=NONE", "1 -1 1 2 2 1 2 0 0 0\n1 1 10\n0 90\n0 90\n10 0\n20 10\n"));
  ASSERT_TRUE(quadrant) << quadrant.error().message;
  EXPECT_EQ(quadrant->horizontals, (std::vector<float>{0, 90, 180, 270, 360}));
  EXPECT_EQ(quadrant->mostCandela, 20.0f);
  EXPECT_NEAR(quadrant->share(1, 0, 0), 0.0f, 1e-6f);
  EXPECT_NEAR(quadrant->share(0, -1, 0), 0.5f, 1e-6f);
  EXPECT_NEAR(quadrant->share(-1, 0, 0), 0.0f, 1e-6f);
  EXPECT_EQ(quadrant->share(0, 0, -1), 0.0f);  // beyond the table
  const auto half = parseIes(iesOf("TILT=NONE", "1 -1 1 2 3 1 2 0 0 0\n1 1 10\n0 90\n90 180 270\n9 0\n9 4\n9 8\n"));
  ASSERT_TRUE(half) << half.error().message;
  EXPECT_EQ(half->horizontals, (std::vector<float>{0, 90, 180, 270, 360}));
  EXPECT_NEAR(half->share(1, 0, 0), 4.0f / 9, 1e-5f);
  EXPECT_NEAR(half->share(0, -1, 0), 8.0f / 9, 1e-5f);
}

// An even sphere of one candela: 4 pi.
TEST(Ies, SolidAngleOfAnEvenLamp) {
  const auto even = parseIes(iesOf("TILT=NONE", "1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 180\n0\n3 3\n"));
  ASSERT_TRUE(even) << even.error().message;
  EXPECT_NEAR(even->solidAngle(), kSphere, 1e-4 * kSphere);  // the midpoint rule in half degrees
}

TEST(Ies, TiltIsReadOver) {
  const auto tilted =
      parseIes(iesOf("TILT=INCLUDE", "1\n3\n0 45 90\n1 .9 .8\n1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 90\n0\n3 1\n"));
  ASSERT_TRUE(tilted) << tilted.error().message;
  EXPECT_EQ(tilted->mostCandela, 3.0f);
}

TEST(Ies, FaultsAreNamedByLine) {
  const auto error = [](const std::string& text) {
    const auto profile = parseIes(text);
    return profile ? "" : profile.error().message;
  };
  EXPECT_EQ(error(""), "line 0: there is no line TILT=; is this an IES file (LM-63)?");
  EXPECT_EQ(error(iesOf("TILT=lamp.tlt", "")), "line 3: TILT= names another file; use TILT=NONE");
  const std::string numbers = "1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 90\n0\n";
  EXPECT_EQ(error(iesOf("TILT=NONE", numbers + "3\n")).find("the file ends before an intensity"), 8u);
  EXPECT_NE(error(iesOf("TILT=NONE", numbers + "3 x\n")).find("'x' stands for an intensity and is not a number"),
            std::string::npos);
  EXPECT_NE(error(iesOf("TILT=NONE", numbers + "3 -1\n")).find("an intensity is negative"), std::string::npos);
  EXPECT_NE(error(iesOf("TILT=NONE", numbers + "3 1 1\n")).find("more than the intensities"), std::string::npos);
  EXPECT_NE(error(iesOf("TILT=NONE", "1 -1 1 2 1 2 2 0 0 0\n1 1 10\n0 90\n0\n3 1\n")).find("type is B"),
            std::string::npos);
  EXPECT_NE(error(iesOf("TILT=NONE", "1 -1 1 2 1 1 2 0 0 0\n1 1 10\n90 0\n0\n3 1\n")).find("must ascend"),
            std::string::npos);
  EXPECT_NE(error(iesOf("TILT=NONE", "1 -1 1 99999999 1 1 2 0 0 0\n")).find("the number of vertical angles"),
            std::string::npos);
}

}  // namespace
}  // namespace lumel
