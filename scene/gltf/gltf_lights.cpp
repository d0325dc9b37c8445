#include "scene/gltf/gltf_lights.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "scene/files/file_access.h"
#include "scene/gltf/gltf_extras.h"
#include "scene/ies/ies_file.h"

namespace lumel {
namespace {

using Problem = std::optional<std::string>;
constexpr double kSphere = 4.0 * std::numbers::pi;

/// Lengths of a node's axes, and the frame of a lamp in it.
struct LampFrame {
  double x = 1.0, y = 1.0, z = 1.0;
  Vec3 right{1, 0, 0}, up{0, 1, 0}, direction{0, 0, -1};
};

/// A panel lies in the plane of the node's x and y and shines to the side of its -z; under skew its second side is made
/// upright on the first, so that its area stays.
LampFrame lampFrame(const glm::dmat4& world) {
  LampFrame frame;
  const glm::dvec3 x(world[0]), y(world[1]), z(world[2]);
  const glm::dvec3 across = glm::cross(x, y);
  if (!(glm::length(across) > 0.0)) return frame;
  const glm::dvec3 right = glm::normalize(x);
  const glm::dvec3 upright = y - right * glm::dot(y, right);
  const glm::dvec3 back = glm::normalize(across) * (glm::dot(across, z) < 0.0 ? -1.0 : 1.0);
  frame.x = glm::length(x);
  frame.y = glm::length(upright);
  frame.z = glm::length(z);
  frame.right = Vec3(right);
  frame.up = Vec3(glm::normalize(upright));
  frame.direction = Vec3(-back);
  return frame;
}

class LightBuilder {
 public:
  LightBuilder(const GltfDocument& document, std::size_t node, const glm::dmat4& world, const LightScale& scale,
               Scene& scene)
      : document_(document),
        node_(document.model.nodes[node]),
        index_(node),
        world_(world),
        frame_(lampFrame(world)),
        scale_(scale),
        scene_(scene) {}

  std::optional<Error> run();

 private:
  std::string where() const {
    return "nodes/" + std::to_string(index_) + (node_.name.empty() ? "" : " '" + node_.name + "'") +
           ": extras.lumel.light";
  }
  void warn(const std::string& problem) const {
    scene_.report.warnings.push_back(document_.name + ": light '" + light_.name + "': " + problem);
  }
  void readPunctual(const tinygltf::Light& source);
  void setCone(const tinygltf::Light& source);
  Problem readSettings(const LightSettings& settings, bool isPunctualNode);
  Problem readProfile(const std::string& reference);
  Problem setShape(const LightSettings& settings);
  Problem setPower(const LightSettings& settings);

  const GltfDocument& document_;
  const tinygltf::Node& node_;
  std::size_t index_;
  const glm::dmat4& world_;
  LampFrame frame_;
  LightScale scale_;
  Scene& scene_;
  Light light_;
};

/// Sets the cone of a spot light, within what KHR_lights_punctual allows.
void LightBuilder::setCone(const tinygltf::Light& source) {
  constexpr double kHalfPi = 1.5707964;  // pi / 2 as a float has it: what exporters write
  const double inner = source.spot.innerConeAngle, outer = source.spot.outerConeAngle;
  if (light_.type == LightType::Spot && !(inner >= 0 && outer > 0 && inner <= outer && outer <= kHalfPi))
    warn("its cone from " + std::to_string(inner) + " to " + std::to_string(outer) +
         " is outside of the format (0 <= inner < outer <= pi/2); it is cut to that");
  light_.outerConeAngle = static_cast<float>(std::clamp(outer, 0.0, static_cast<double>(kPi) / 2));
  light_.innerConeAngle = static_cast<float>(std::clamp(inner, 0.0, static_cast<double>(light_.outerConeAngle)));
}

void LightBuilder::readPunctual(const tinygltf::Light& source) {
  light_.name = !source.name.empty() ? source.name : node_.name;
  light_.type = source.type == "spot"          ? LightType::Spot
                : source.type == "directional" ? LightType::Directional
                                               : LightType::Point;
  if (source.color.size() == 3) {
    if (std::any_of(source.color.begin(), source.color.end(), [](double c) { return c < 0; }))
      warn("its colour is negative and counts as 0 there");
    for (int c = 0; c < 3; ++c)
      light_.color[c] = static_cast<float>(std::max(source.color[static_cast<std::size_t>(c)], 0.0));
  }
  if (source.intensity < 0) warn("its intensity is negative; it gives no light");
  const double scale = light_.type == LightType::Directional ? scale_.lux : scale_.candela;
  light_.intensity = static_cast<float>(std::max(source.intensity, 0.0) * scale);
  light_.range = static_cast<float>(std::max(source.range, 0.0));
  setCone(source);
  const glm::dvec3 away = -glm::dvec3(world_[2]);
  if (glm::length(away) > 0) light_.direction = Vec3(glm::normalize(away));
}

Problem LightBuilder::readProfile(const std::string& reference) {
  std::vector<std::uint8_t> bytes;
  std::string name = reference;
  if (isDataUri(reference)) {
    auto decoded = decodeDataUri(reference);
    if (!decoded) return "ies: " + decoded.error().message;
    bytes = *std::move(decoded);
    name = "data";
  } else {
    const auto file = resolveReference(document_.folder, percentDecode(reference), document_.options);
    if (!file) return "ies: " + file.error().message;
    auto read = readFile(*file);
    if (!read) return "ies: " + read.error().message + "; put the file beside the scene";
    bytes = *std::move(read);
  }
  auto profile = parseIes({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!profile) return "ies: " + name + ": " + profile.error().message;
  light_.profile = std::make_shared<const LightProfile>(*std::move(profile));
  return std::nullopt;
}

/// Sets what a kind of its own is like. Sizes are in the node's space and scale with it.
Problem LightBuilder::setShape(const LightSettings& settings) {
  const std::string& type = *settings.type;
  light_.name = node_.name;
  light_.type = type == "rectangle" ? LightType::Rectangle : type == "disc" ? LightType::Disc : LightType::Sphere;
  light_.direction = frame_.direction;
  if (light_.type == LightType::Rectangle) {
    if (!settings.size) return "a rectangle needs \"size\": [WIDTH, HEIGHT] in metres";
    if (settings.radius) return "radius is for discs and spheres; a rectangle has a size";
    light_.size = {static_cast<float>(settings.size->x * frame_.x), static_cast<float>(settings.size->y * frame_.y)};
    return std::nullopt;
  }
  if (settings.size) return "size is for rectangles; a " + type + " has a radius";
  if (!settings.radius || (*settings.radius == 0.0 && !settings.ies)) return "a " + type + " needs a radius above 0";
  const bool isDisc = light_.type == LightType::Disc;
  const double least = std::min({frame_.x, frame_.y, isDisc ? frame_.y : frame_.z});
  const double most = std::max({frame_.x, frame_.y, isDisc ? frame_.y : frame_.z});
  const double scale = isDisc ? std::sqrt(frame_.x * frame_.y) : std::cbrt(frame_.x * frame_.y * frame_.z);
  if (most > 1.01 * least) warn("its node is scaled unevenly; it is a round " + type + " of the mean scale");
  light_.radius = static_cast<float>(*settings.radius * scale);
  return std::nullopt;
}

/// Sets the intensity of a kind of its own. Panels send pi L A from their front; spheres 4 pi I.
Problem LightBuilder::setPower(const LightSettings& settings) {
  const int given = settings.watts.has_value() + settings.nits.has_value() + settings.lumens.has_value() +
                    settings.candela.has_value();
  const double profiled = light_.profile ? static_cast<double>(light_.profile->mostCandela) : 0.0;
  if (given == 0 && light_.profile) {
    light_.intensity = static_cast<float>(profiled * scale_.lumens);
    return std::nullopt;
  }
  if (given != 1) return "give one of watts, lumens and nits, which say how bright it is";
  if (settings.candela && light_.type != LightType::Sphere) return "candela is for spheres; give watts, lumens or nits";
  const double area = light_.type == LightType::Rectangle
                          ? static_cast<double>(light_.size.x) * static_cast<double>(light_.size.y)
                          : std::numbers::pi * static_cast<double>(light_.radius) * static_cast<double>(light_.radius);
  double perFlux = 1.0 / (std::numbers::pi * area);
  if (light_.type == LightType::Sphere) perFlux = 1.0 / (light_.profile ? light_.profile->solidAngle() : kSphere);
  double intensity = 0.0;
  if (settings.watts) intensity = *settings.watts * perFlux;
  if (settings.lumens) intensity = *settings.lumens * scale_.lumens * perFlux;
  if (settings.candela) intensity = *settings.candela * scale_.candela;
  if (settings.nits) intensity = *settings.nits * (light_.type == LightType::Sphere ? area : 1.0);
  if (!std::isfinite(intensity)) return "its size must be above 0";
  light_.intensity = static_cast<float>(std::min(intensity, 1e37));
  return std::nullopt;
}

Problem LightBuilder::readSettings(const LightSettings& settings, bool isPunctualNode) {
  if (settings.mode) light_.mode = *settings.mode;
  if (settings.shadowMask) light_.hasShadowMask = *settings.shadowMask;
  if (settings.type) {
    if (isPunctualNode) return "type is for nodes without a light of KHR_lights_punctual; take one of the two away";
    if (settings.angle) return "angle is for directional lights";
    if (auto problem = setShape(settings)) return problem;
  } else {
    if (!isPunctualNode)
      return "the node has no light of KHR_lights_punctual; give a type, \"rectangle\", \"disc\" or \"sphere\"";
    const bool isSun = light_.type == LightType::Directional;
    if (settings.size || settings.watts || settings.nits || settings.lumens || settings.candela || settings.color)
      return "size, watts, nits, lumens, candela and color go with a type; the light has its own brightness and colour";
    if (settings.angle && !isSun) return "angle is for directional lights; give a radius";
    if (settings.radius && isSun) return "radius is for points and spots; give an angle in degrees";
    if (settings.radius) light_.radius = static_cast<float>(*settings.radius);
    if (settings.angle) light_.halfAngle = static_cast<float>(*settings.angle * std::numbers::pi / 360.0);
  }
  if (settings.ies) {
    if (light_.type == LightType::Directional || isPanel(light_.type)) return "ies is for points, spots and spheres";
    if (auto problem = readProfile(*settings.ies)) return problem;
  }
  if (!settings.type) return std::nullopt;
  if (settings.color) light_.color = *settings.color;
  return setPower(settings);
}

std::optional<Error> LightBuilder::run() {
  const auto* extension = findExtension(node_.extensions, "KHR_lights_punctual");
  light_.position = Vec3(glm::dvec3(world_[3]));
  light_.right = frame_.right;
  light_.up = frame_.up;
  LightSettings settings;
  bool isSet = false;
  if (extension != nullptr) {
    const auto& source =
        document_.model.lights[static_cast<std::size_t>(static_cast<int>(valueNumber(*extension, "light", 0)))];
    readPunctual(source);
    if (auto problem = readLightSettings(source.extras, settings, isSet)) return document_.error(where(), *problem);
  }
  if (auto problem = readLightSettings(node_.extras, settings, isSet)) return document_.error(where(), *problem);
  if (isSet)
    if (auto problem = readSettings(settings, extension != nullptr)) return document_.error(where(), *problem);
  if (extension != nullptr || isSet) scene_.lights.push_back(std::move(light_));
  return std::nullopt;
}

}  // namespace

std::optional<Error> addLight(const GltfDocument& document, std::size_t node, const glm::dmat4& worldFromNode,
                              const LightScale& scale, Scene& scene) {
  return LightBuilder(document, node, worldFromNode, scale, scene).run();
}

bool looksLikeAreaLight(const tinygltf::Node& node) {
  if (node.mesh >= 0 || node.camera >= 0 || node.skin >= 0 || !node.children.empty()) return false;
  if (findExtension(node.extensions, "KHR_lights_punctual") != nullptr || hasLightSettings(node.extras)) return false;
  if (node.extras.IsObject() && node.extras.Has("type") && node.extras.Get("type").IsString() &&
      lowerCase(node.extras.Get("type").Get<std::string>()) == "area")
    return true;
  std::string letters;
  for (const char c : node.name)
    if (std::isalpha(static_cast<unsigned char>(c)))
      letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (letters == "area") return true;  // "Area.001"
  return std::ranges::any_of(std::array{"arealight", "arealamp", "rectlight", "disklight"},
                             [&](const char* part) { return letters.find(part) != std::string::npos; });
}

}  // namespace lumel
