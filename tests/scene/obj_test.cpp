#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "scene/images/image_io.h"
#include "scene/images/texture.h"
#include "scene/load/load_scene.h"
#include "scene/obj/obj_loader.h"
#include "scene/triangles/polygon.h"
#include "tests/mentions.h"
#include "tests/scratch.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

class Obj : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = scratch();
    fs::create_directories(folder_ / "scene");
  }
  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / "scene" / name, std::ios::binary) << text;
  }
  void writePng(const std::string& name, const Image& image) {
    WriteImageOptions options;
    options.format = PixelFormat::U8;
    ASSERT_TRUE(writeImage(folder_ / "scene" / name, image, options));
  }
  Expected<Scene> load(const std::string& text) { return loadObj(text, "level.obj", folder_ / "scene", {}); }
  std::string errorOf(const std::string& text) {
    auto result = load(text);
    if (result) return "(it loads)";
    EXPECT_EQ(result.error().kind, ErrorKind::Input);
    return result.error().message;
  }
  fs::path folder_;
};

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
const std::string kFace = "f 1/1 2/2 3/3 4/4\n";

TEST_F(Obj, SquareWithUvsTurnedToRunDown) {
  auto scene = load(kSquare + kFace);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 1u);
  const Primitive& p = scene->primitive(0, 0);
  EXPECT_EQ(p.triangleCount(), 2u);
  EXPECT_EQ(p.positions.size(), 4u);
  for (std::size_t v = 0; v < 4; ++v) {
    EXPECT_EQ(p.normals[v], Vec3(0, 0, 1));
    EXPECT_EQ(p.uvSets[0][v], Vec2(p.positions[v].x, 1 - p.positions[v].y));
  }
  EXPECT_EQ(scene->materials[static_cast<std::size_t>(p.material)].name, "default");
}

TEST_F(Obj, ObjectsBecomeInstancesAndMaterialsPrimitives) {
  write("m.mtl", "newmtl red\nKd 1 0 0\nnewmtl glow\nKd 0 0 0\nKe 5 6 7\n");
  auto scene = load("mtllib m.mtl\n" + kSquare + "o floor\nusemtl red\n" + kFace + "usemtl glow\n" + kFace +
                    "o wall\nusemtl red\n" + kFace + "usemtl none\n" + kFace);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 2u);
  EXPECT_EQ(scene->instances[0].name, "floor");
  EXPECT_EQ(scene->instances[1].name, "wall");
  ASSERT_EQ(scene->meshes[0].primitives.size(), 2u);
  EXPECT_EQ(scene->materials[0].baseColor, Vec4(1, 0, 0, 1));
  EXPECT_EQ(scene->materials[1].emission, Vec3(5, 6, 7));
  ASSERT_EQ(scene->meshes[1].primitives.size(), 2u);
  EXPECT_EQ(scene->meshes[1].primitives[1].material, 2);
}

TEST_F(Obj, SmoothingGroupsAndTheirAbsence) {
  // A roof: two squares that meet at a right angle along x.
  const std::string roof = "v 0 0 1\nv 1 0 1\nv 1 1 0\nv 0 1 0\nv 0 0 -1\nv 1 0 -1\n";
  const std::string faces = "f 1 2 3 4\nf 4 3 6 5\n";
  const auto ridge = [&](const std::string& group) {
    auto scene = load(roof + group + faces);
    std::vector<Vec3> normals;
    const Primitive& p = scene->primitive(0, 0);
    for (std::size_t v = 0; v < p.positions.size(); ++v)
      if (p.positions[v].y > 0.5f) normals.push_back(p.normals[v]);
    return normals;
  };
  const auto smooth = ridge("s 1\n");
  ASSERT_EQ(smooth.size(), 2u);
  for (const Vec3& n : smooth) EXPECT_NEAR(n.y, 1, 1e-6);
  for (const std::string off : {"", "s off\n", "s 0\n"}) {
    const auto flat = ridge(off);
    ASSERT_EQ(flat.size(), 4u);
    for (const Vec3& n : flat) EXPECT_NEAR(n.y, std::sqrt(0.5f), 1e-6);
  }
}

TEST_F(Obj, NormalsOfTheFileAndNegativeIndices) {
  auto scene = load("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 1 1\nf -3//-1 -2//-1 -1//-1\n");
  ASSERT_TRUE(scene) << scene.error().message;
  for (const Vec3& n : scene->primitive(0, 0).normals) EXPECT_NEAR(n.y, std::sqrt(0.5f), 1e-6);
}

TEST_F(Obj, NormalsThatAreNamedButMissingAreMade) {
  auto scene = load("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//1 2//2 3//3\n");
  ASSERT_TRUE(scene) << scene.error().message;
  for (const Vec3& n : scene->primitive(0, 0).normals) EXPECT_EQ(n, Vec3(0, 0, 1));
  ASSERT_EQ(scene->report.warnings.size(), 1u);
  EXPECT_TRUE(mentions(scene->report.warnings[0], "faces refer to normals, but there are none"));
}

TEST_F(Obj, MaterialsWithoutKdAreWhiteAndMissingFilesWarn) {
  write("m.mtl", "newmtl a\nmap_Kd gone\\away.png\n");
  auto scene = load("mtllib m.mtl\n" + kSquare + "usemtl a\n" + kFace);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->materials[0].baseColor, Vec4(1));
  ASSERT_EQ(scene->report.warnings.size(), 1u);
  EXPECT_TRUE(mentions(scene->report.warnings[0], "gone/away.png: no such file"));
  scene = load("mtllib gone.mtl\n" + kSquare + "usemtl a\n" + kFace);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->report.warnings.size(), 1u);
  EXPECT_TRUE(mentions(scene->report.warnings[0], "gone.mtl: no such file; faces get a default material"));
}

TEST_F(Obj, SeparateOpacityIsCombinedIntoOneImage) {
  Image color(2, 1, 3);
  color.setRgb(0, 0, {1, 0, 0});
  color.setRgb(1, 0, {0, 0, 1});
  Image alpha(4, 1, 1);
  alpha.pixels = {1, 1, 0, 0};
  writePng("c.png", color);
  writePng("a.png", alpha);
  write("m.mtl",
        "newmtl leaf\nKd 1 1 1\nmap_Kd c.png\nmap_d a.png\nnewmtl glass\nKd 1 1 1\nd 0.25\nnewmtl tr\nTr 0.75\n");
  auto scene = load("mtllib m.mtl\n" + kSquare + "usemtl leaf\n" + kFace);
  ASSERT_TRUE(scene) << scene.error().message;
  const Material& leaf = scene->materials[0];
  EXPECT_EQ(leaf.alphaMode, AlphaMode::Mask);
  ASSERT_EQ(scene->images.size(), 1u);
  auto texture = Texture::decode(scene->images[0], ColorSpace::Srgb);
  ASSERT_TRUE(texture) << texture.error().message;
  EXPECT_EQ(texture->fetch(0, 0), Vec4(1, 0, 0, 1));
  EXPECT_EQ(texture->fetch(1, 0), Vec4(0, 0, 1, 0));
  EXPECT_EQ(scene->materials[1].alphaMode, AlphaMode::Blend);
  EXPECT_EQ(scene->materials[1].baseColor.w, 0.25f);
  EXPECT_EQ(scene->materials[2].baseColor.w, 0.25f);
}

TEST_F(Obj, BumpMapsAreNormalMapsOnlyIfTheyLookLikeIt) {
  Image heights(2, 2, 3, 0.5f), normals(2, 2, 3);
  for (int i = 0; i < 4; ++i) normals.setRgb(i % 2, i / 2, {0.5f, 0.5f, 1});
  writePng("h.png", heights);
  writePng("n.png", normals);
  write("m.mtl", "newmtl h\nmap_bump h.png\nnewmtl n\nbump -bm 0.5 n.png\nnewmtl said\nnorm h.png\n");
  auto scene = load("mtllib m.mtl\n" + kSquare + "usemtl h\n" + kFace + "usemtl n\n" + kFace + "usemtl said\n" + kFace);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_FALSE(scene->materials[0].normalMap);
  ASSERT_EQ(scene->report.warnings.size(), 1u);
  EXPECT_TRUE(
      mentions(scene->report.warnings[0], "material 'h': bump map 'h.png' holds heights, not normals; ignored"));
  EXPECT_TRUE(scene->materials[1].normalMap);
  EXPECT_EQ(scene->materials[1].normalScale, 0.5f);
  EXPECT_TRUE(scene->materials[2].normalMap);
  EXPECT_TRUE(scene->primitive(0, 0).tangents.empty());
  ASSERT_FALSE(scene->primitive(0, 1).tangents.empty());
  EXPECT_EQ(scene->primitive(0, 1).tangents[0], Vec4(1, 0, 0, 1));
}

TEST_F(Obj, MapOptionsWorkOnUvsThatRunUp) {
  writePng("c.png", Image(2, 2, 3, 0.5f));
  write("m.mtl", "newmtl a\nmap_Kd -s 2 4 1 -o 0.5 0.25 0 -clamp on c.png\n");
  auto scene = load("mtllib m.mtl\n" + kSquare + "usemtl a\n" + kFace);
  ASSERT_TRUE(scene) << scene.error().message;
  const TextureRef& ref = scene->materials[0].baseColorMap;
  EXPECT_EQ(ref.wrapU, Wrap::Clamp);
  // MTL, v up: (0.1, 0.2) -> (0.7, 1.05); in v down: (0.1, 0.8) -> (0.7, -0.05).
  const Vec3 uv = ref.uvMatrix * Vec3(0.1f, 0.8f, 1);
  EXPECT_NEAR(uv.x, 0.7f, 1e-6);
  EXPECT_NEAR(uv.y, -0.05f, 1e-6);
}

TEST_F(Obj, ErrorsNameTheLine) {
  EXPECT_EQ(errorOf(kSquare + "f 1 2 9\n"),
            "level.obj: line 9: a face refers to vertex 9, but there are 4; repair the file or export it again");
  EXPECT_EQ(
      errorOf(kSquare + "f 1/7 2/2 3/3\n"),
      "level.obj: line 9: a face refers to texture coordinate 7, but there are 4; repair the file or export it again");
  EXPECT_EQ(errorOf(kSquare + "f 1 2 0\n"),
            "level.obj: line 9: a face refers to vertex 0, but there are 4; repair the file or export it again");
  EXPECT_EQ(errorOf(kSquare + "f 1 2 -5\n"),
            "level.obj: line 9: a face refers to vertex -5, but there are 4; repair the file or export it again");
  EXPECT_TRUE(
      mentions(errorOf(kSquare + "f 1 2 99999999999999999999\n"), "line 9: a face with '99999999999999999999'"));
  for (const char* bad : {"nan", "inf", "1e39", "x", "1.#QNAN"})
    EXPECT_TRUE(mentions(errorOf(std::string("# head\nv 0 0 ") + bad + "\n"), "line 2: a vertex with '")) << bad;
  EXPECT_TRUE(mentions(errorOf("v 1 2\n"), "line 1: a vertex with too few numbers"));
  std::string big = "v 0 0 0\nf";
  for (int i = 0; i < 300; ++i) big += " 1";
  EXPECT_TRUE(mentions(errorOf(big + "\n"), "line 2: a polygon with 300 corners"));
  EXPECT_EQ(errorOf("v +1 1e-60 .5\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n"), "(it loads)");
}

TEST_F(Obj, PathsStayInTheScenesFolder) {
  EXPECT_TRUE(mentions(errorOf("mtllib ../m.mtl\n" + kSquare + kFace),
                       "level.obj: mtllib: '../m.mtl' leaves the scene's folder"));
  write("m.mtl", "newmtl a\nmap_Kd ../../c.png\n");
  EXPECT_TRUE(mentions(errorOf("mtllib m.mtl\n" + kSquare + kFace), "leaves the scene's folder"));
}

TEST_F(Obj, DegenerateFacesLinesAndEmptyFiles) {
  auto scene = load(kSquare + "f 1 2 2\nf 1 2\nl 1 2\n" + kFace);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->report.degenerateTriangles, 1u);
  EXPECT_EQ(scene->report.skippedPrimitives, 1u);
  EXPECT_EQ(scene->primitive(0, 0).triangleCount(), 2u);
  auto empty = load("");
  ASSERT_TRUE(empty);
  EXPECT_TRUE(empty->instances.empty());
}

TEST_F(Obj, LoadsByExtension) {
  write("level.OBJ", kSquare + kFace);
  auto scene = loadScene(folder_ / "scene" / "level.OBJ");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->instances.size(), 1u);
}

double totalArea(const std::vector<Vec3>& p, const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  double area = 0;
  for (const auto& t : triangles) {
    const Vec3 cross = glm::cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]);
    EXPECT_GE(cross.z, 0);  // wound as the polygon
    area += 0.5 * cross.z;
  }
  return area;
}

TEST(Polygon, ConcavePolygonsAreCoveredOnce) {
  const std::vector<Vec3> arrow = {{0, 0, 0}, {2, 0, 0}, {0.2f, 0.2f, 0}, {0, 2, 0}};  // reflex at corner 2
  EXPECT_NEAR(totalArea(arrow, triangulatePolygon(arrow)), 0.4, 1e-6);
  const std::vector<Vec3> comb = {{0, 0, 0}, {5, 0, 0}, {5, 2, 0}, {4, 2, 0}, {4, 1, 0}, {3, 1, 0},
                                  {3, 2, 0}, {2, 2, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}};
  const auto triangles = triangulatePolygon(comb);
  EXPECT_EQ(triangles.size(), 10u);
  EXPECT_NEAR(totalArea(comb, triangles), 8, 1e-6);
}

TEST(Polygon, DegenerateOnesGiveTriangles) {
  const std::vector<Vec3> line(6, Vec3(1, 2, 3));
  EXPECT_EQ(triangulatePolygon(line).size(), 4u);
  const std::vector<Vec3> bowtie = {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_EQ(triangulatePolygon(bowtie).size(), 2u);
  EXPECT_TRUE(triangulatePolygon(std::vector<Vec3>(2)).empty());
}

}  // namespace
}  // namespace lumel
