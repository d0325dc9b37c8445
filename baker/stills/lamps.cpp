#include "baker/stills/lamps.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "scene/base/split_text.h"

namespace lumel {
namespace {

bool readNumber(const std::string& text, float& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(number);
}

bool readVector(const std::string& text, Vec3& vector) {
  const auto parts = splitText(text, ',');
  return parts.size() == 3 && readNumber(parts[0], vector.x) && readNumber(parts[1], vector.y) &&
         readNumber(parts[2], vector.z);
}

bool readDirection(const std::string& text, Vec3& direction) {
  if (!readVector(text, direction) || !(glm::length(direction) > 0.0f)) return false;
  direction = glm::normalize(direction);
  return true;
}

/// The parts of one lamp, from front to back.
class LampParts {
 public:
  LampParts(std::vector<std::string> parts, const Camera& camera) : parts_(std::move(parts)), camera_(camera) {}

  bool read(Light& lamp) {
    const std::string kind = take();
    if (kind == "sun") {
      lamp.type = LightType::Directional;
      if (!readDirection(take(), lamp.direction)) return false;
    } else if (kind == "point" || kind == "spot") {
      lamp.type = kind == "spot" ? LightType::Spot : LightType::Point;
      if (!readPlace(lamp)) return false;
    } else {
      return false;
    }
    if (!readNumber(take(), lamp.intensity) || lamp.intensity < 0.0f) return false;
    if (lamp.type == LightType::Spot) {
      float degrees = 0.0f;
      if (!readNumber(take(), degrees) || !(degrees > 0.0f) || degrees > 90.0f) return false;
      lamp.outerConeAngle = degrees * kPi / 180.0f;
      lamp.innerConeAngle = 0.5f * lamp.outerConeAngle;
    }
    if (next_ == parts_.size()) return true;
    return readVector(take(), lamp.color) && lamp.color == glm::max(lamp.color, Vec3(0.0f)) && next_ == parts_.size();
  }

 private:
  std::string take() { return next_ < parts_.size() ? parts_[next_++] : std::string(); }

  bool readPlace(Light& lamp) {
    const std::string place = take();
    if (place != "camera")
      return readVector(place, lamp.position) &&
             (lamp.type == LightType::Point || readDirection(take(), lamp.direction));
    constexpr float kHand = 0.2f;
    const Mat3 turn(camera_.worldFromCamera);
    lamp.position = Vec3(camera_.worldFromCamera[3]) + kHand * (glm::normalize(turn[0]) - glm::normalize(turn[1]));
    lamp.direction = -glm::normalize(turn[2]);
    return true;
  }

  std::vector<std::string> parts_;
  std::size_t next_ = 0;
  const Camera& camera_;
};

}  // namespace

Expected<std::vector<Light>> parseLamps(const std::string& text, const Camera& camera) {
  std::vector<Light> lamps;
  if (text.empty()) return lamps;
  for (const std::string& one : splitText(text, ';')) {
    Light lamp;
    if (!LampParts(splitText(one, ':'), camera).read(lamp))
      return usageError("--light: '" + one +
                        "' is none of point:X,Y,Z:CANDELA, spot:X,Y,Z:DX,DY,DZ:CANDELA:DEGREES, "
                        "spot:camera:CANDELA:DEGREES, sun:DX,DY,DZ:LUX (each may end in :R,G,B)");
    lamps.push_back(lamp);
  }
  return lamps;
}

Vec3 lampIrradiance(const Light& lamp, const Vec3& point) {
  const Vec3 strength = lamp.intensity * lamp.color;
  if (lamp.type == LightType::Directional) return strength;
  const Vec3 way = point - lamp.position;
  const float squared = glm::dot(way, way);
  if (!(squared > 0.0f)) return Vec3(0.0f);
  const Vec3 arriving = strength / squared;
  if (lamp.type == LightType::Point) return arriving;
  const float inner = std::cos(lamp.innerConeAngle), outer = std::cos(lamp.outerConeAngle);
  const float within = (glm::dot(way, lamp.direction) / std::sqrt(squared) - outer) / std::max(inner - outer, 1e-6f);
  const float share = std::clamp(within, 0.0f, 1.0f);
  return arriving * (share * share);
}

}  // namespace lumel
