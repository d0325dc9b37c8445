#include "baker/commands/scene_figures.h"

#include <algorithm>
#include <limits>

#include "baker/bake/memory_estimate.h"
#include "lightmap/atlas/object_layouts.h"
#include "lightmap/atlas/scene_uvs.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

std::size_t toSize(int i) { return static_cast<std::size_t>(i); }
Json toJson(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }

struct Totals {
  std::size_t instancedTriangles = 0;
  double receivingArea = 0.0;  // square metres that get a lightmap, weighted by density
  Vec3 least{std::numeric_limits<float>::max()};
  Vec3 most{std::numeric_limits<float>::lowest()};
};

Totals addUp(const Scene& scene) {
  Totals totals;
  for (const Instance& instance : scene.instances) {
    totals.receivingArea += weightedArea(scene, instance);
    for (const Primitive& primitive : scene.meshes[toSize(instance.mesh)].primitives) {
      totals.instancedTriangles += primitive.triangleCount();
      for (const Vec3& p : primitive.positions) {
        const Vec3 world(instance.worldFromObject * Vec4(p, 1.0f));
        totals.least = glm::min(totals.least, world);
        totals.most = glm::max(totals.most, world);
      }
    }
  }
  return totals;
}

Json describeMaterials(const Scene& scene) {
  Json list = Json::array();
  for (const Material& m : scene.materials) {
    std::string text = m.name.empty() ? "(unnamed)" : m.name;
    if (m.baseColorMap) text += ", colour map";
    if (m.normalMap) text += ", normal map";
    if (m.emission != Vec3(0.0f)) text += ", emissive";
    if (m.alphaMode == AlphaMode::Mask) text += ", alpha mask";
    if (m.alphaMode == AlphaMode::Blend) text += ", alpha blend";
    if (m.doubleSided) text += ", double-sided";
    if (m.unlit) text += ", unlit";
    list.push_back(text);
  }
  return list;
}

Json describeLights(const Scene& scene) {
  Json list = Json::array();
  for (const Light& light : scene.lights) {
    Json json = {
        {"name", light.name},           {"type", nameOf(light.type)},         {unitOf(light.type), light.intensity},
        {"color", toJson(light.color)}, {"position", toJson(light.position)}, {"direction", toJson(light.direction)}};
    if (light.type == LightType::Rectangle) json["sizeMeters"] = {light.size.x, light.size.y};
    if (light.radius > 0.0f) json["radiusMeters"] = light.radius;
    if (light.halfAngle > 0.0f) json["angleDegrees"] = light.halfAngle * 360.0f * kInvPi;
    if (light.profile) json["profileCandela"] = light.profile->mostCandela;
    if (light.mode != LightMode::All) json["mode"] = nameOf(light.mode);
    if (light.hasShadowMask) json["shadowMask"] = true;
    list.push_back(std::move(json));
  }
  return list;
}

Json describeSky(const Environment& sky) {
  Json json = {{"strength", sky.strength}};
  if (sky.image.empty()) {
    json["color"] = toJson(sky.color);
  } else {
    json["pixels"] = {sky.image.width, sky.image.height};
    json["rotationDegrees"] = sky.rotationDegrees;
  }
  return json;
}

Json countUvSets(const Scene& scene) {
  std::vector<std::size_t> counts;
  std::size_t primitives = 0;
  for (const Mesh& mesh : scene.meshes)
    for (const Primitive& primitive : mesh.primitives) {
      ++primitives;
      counts.resize(std::max(counts.size(), primitive.uvSets.size()), 0);
      for (std::size_t set = 0; set < primitive.uvSets.size(); ++set)
        if (!primitive.uvSets[set].empty()) ++counts[set];
    }
  Json json = Json::object();
  for (std::size_t set = 0; set < counts.size(); ++set)
    json["TEXCOORD_" + std::to_string(set)] =
        std::to_string(counts[set]) + " of " + std::to_string(primitives) + " primitives";
  return json;
}

/// What the lightmap UVs of the scene give before anything is packed.
struct UvFigures {
  double packedArea = 0.0;  // square metres, weighted by density, that need charts or rectangles
  double placedArea = 0.0;  // of surface whose UVs are places on pages
  double placedTexels = 0.0;
  int placedPages = 0;
  Json json;
};

UvFigures describeUvs(const Scene& scene, const AtlasOptions& options) {
  const SceneUvs uvs = examineSceneUvs(scene, receiversOf(scene), options);
  UvFigures figures;
  figures.placedPages = uvs.pageCount;
  for (const SceneUvUse& use : uvs.uses) {
    const double area = weightedArea(scene, scene.instances[toSize(use.instance)]);
    const bool placed = use.used && !uvs.perObject;
    (placed ? figures.placedArea : figures.packedArea) += area;
    if (placed) figures.placedTexels += uvs.reports[toSize(use.report)].coveredTexels;
  }
  figures.json["use"] = describeUvChoice(uvs, options.uvSource);
  Json invalid = Json::array();
  for (const UvReport& report : uvs.reports)
    if (!report.valid)
      invalid.push_back(report.mesh + " (" + std::to_string(report.instances) +
                        (report.instances == 1 ? " object)" : " objects)"));
  if (!invalid.empty()) figures.json["notValid"] = std::move(invalid);
  return figures;
}

Json estimate(const UvFigures& uvs, const BakeSize& scene, const AtlasOptions& options) {
  // So much of a page is surface; generated charts stretch little, so area times density squared gives texels. Partly
  // covered ones at the borders of charts come on top.
  constexpr double kPacking = 0.82;
  constexpr double kTouched = 1.07;
  const double bytesPerPageTexel = (3 * (scene.maps + 1) + 4) * sizeof(float);  // what the images hold
  const double page = static_cast<double>(options.pageSize) * static_cast<double>(options.pageSize);
  if (!(uvs.packedArea + uvs.placedArea > 0.0)) return nullptr;
  const double placedDensity = uvs.placedArea > 0.0 ? std::sqrt(uvs.placedTexels / uvs.placedArea) : 0.0;
  double density = placedDensity, texels = 0.0, pages = 0.0;
  if (uvs.packedArea > 0.0) {
    density = options.texelsPerMeter > 0.0f ? static_cast<double>(options.texelsPerMeter)
                                            : std::sqrt(kPacking * page / uvs.packedArea);
    if (!(options.texelsPerMeter > 0.0f) && placedDensity > 0.0) density = std::min(density, placedDensity);
    texels = uvs.packedArea * density * density;
    pages = std::max(1.0, std::ceil(texels / (kPacking * page) - 1e-6));
  }
  texels += uvs.placedTexels;
  pages += uvs.placedPages;
  BakeSize size = scene;
  size.pageTexels = pages * page;
  size.coveredTexels = kTouched * texels;
  return {{"texelsPerMeter", density},
          {"texels", std::llround(texels)},
          {"pages", std::llround(pages)},
          {"imageBytes", std::llround(pages * page * bytesPerPageTexel)},
          {"bakeMemoryBytes", std::llround(bakeMemory(size))}};
}

}  // namespace

Json describeScene(const Scene& scene, const AtlasOptions& options) {
  const Totals totals = addUp(scene);
  std::size_t primitives = 0;
  std::size_t triangles = 0;
  for (const Mesh& mesh : scene.meshes)
    for (const Primitive& primitive : mesh.primitives) {
      ++primitives;
      triangles += primitive.triangleCount();
    }
  Json images = Json::array();
  for (const ImageSource& image : scene.images)
    images.push_back(image.name + (image.encoded.empty() ? " (missing)"
                                                         : " (" + image.mimeType + ", " +
                                                               std::to_string(image.encoded.size()) + " bytes)"));
  Json cameras = Json::array();
  for (const Camera& camera : scene.cameras)
    cameras.push_back(camera.name + (camera.orthographic ? " (orthographic)" : " (perspective)"));
  Json json = {{"meshes", scene.meshes.size()},
               {"primitives", primitives},
               {"triangles", triangles},
               {"instances", scene.instances.size()},
               {"instancedTriangles", totals.instancedTriangles},
               {"degenerateTriangles", scene.report.degenerateTriangles},
               {"skippedPrimitives", scene.report.skippedPrimitives}};
  if (totals.instancedTriangles > 0) json["bounds"] = {{"min", toJson(totals.least)}, {"max", toJson(totals.most)}};
  json["receivingAreaSquareMeters"] = totals.receivingArea;
  json["uvSets"] = countUvSets(scene);
  json["materials"] = describeMaterials(scene);
  json["images"] = std::move(images);
  json["lights"] = describeLights(scene);
  if (!scene.environment.isBlack()) json["sky"] = describeSky(scene.environment);
  json["cameras"] = std::move(cameras);
  UvFigures uvs = describeUvs(scene, options);
  json["lightmapUvs"] = std::move(uvs.json);
  json["estimate"] = estimate(uvs, sceneSize(scene), options);
  if (!scene.report.notes.empty()) json["notes"] = scene.report.notes;
  json["warnings"] = scene.report.warnings;
  return json;
}

}  // namespace lumel
