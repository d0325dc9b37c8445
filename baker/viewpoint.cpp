#include "baker/viewpoint.h"

#include <algorithm>
#include <array>
#include <map>

#include "scene/parallel.h"

namespace lumel {
namespace {

constexpr float kInsideFov = 0.95f;  // radians, vertical: a wide view of a room
constexpr float kOutsideFov = 0.65f;
constexpr int kPlaces = 400;
constexpr int kDirections = 12;
constexpr std::array<float, 2> kPitches = {-0.06f, -0.25f};  // radians: eyes rest a little below the horizon

struct Candidate {
  Camera camera;
  double score = -1e9;
};

/// Radical inverse: coordinate of the Halton sequence.
float radicalInverse(unsigned i, unsigned base) {
  double result = 0.0;
  double digit = 1.0 / base;
  for (; i > 0; i /= base, digit /= base) result += digit * (i % base);
  return static_cast<float>(result);
}

class Chooser {
 public:
  Chooser(const Compositor& compositor, float aspect)
      : compositor_(compositor),
        aspect_(aspect),
        least_(compositor.boundsMin()),
        most_(compositor.boundsMax()),
        size_(std::max(glm::length(most_ - least_), 1e-6f)) {}

  Camera choose() {
    std::vector<Candidate> candidates = inside();
    addOutside(candidates);
    score(candidates, 16, 9);
    constexpr std::size_t kRefined = 12;
    const std::size_t kept = std::min(kRefined, candidates.size());
    // Stable order for equal scores: the choice must not depend on the library's sort.
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    candidates.resize(kept);
    score(candidates, 64, 36);
    return std::max_element(candidates.begin(), candidates.end(),
                            [](const Candidate& a, const Candidate& b) { return a.score < b.score; })
        ->camera;
  }

 private:
  std::vector<Candidate> inside() const {
    std::vector<Candidate> candidates;
    for (unsigned i = 1; i <= kPlaces; ++i) {
      const Vec3 share(radicalInverse(i, 2), radicalInverse(i, 3), radicalInverse(i, 5));
      const Vec3 start = least_ + share * (most_ - least_);
      const Sighting floor = compositor_.look(start, Vec3(0, -1, 0));
      if (!floor.surface || floor.throughBack) continue;
      const Sighting ceiling = compositor_.look(start, Vec3(0, 1, 0));
      if (ceiling.throughBack) continue;
      const Vec3 ground = start - Vec3(0, floor.distance, 0);
      // Files come in any unit, so the eye's height is a share of the room's, or of the scene's in the open.
      const float room = ceiling.surface ? floor.distance + ceiling.distance : most_.y - ground.y;
      const float height = std::min(0.5f * room, 0.12f * size_);
      if (!(height > 1e-3f * size_)) continue;
      const Vec3 eye = ground + Vec3(0, height, 0);
      for (int k = 0; k < kDirections; ++k)
        for (float pitch : kPitches) {
          const float yaw =
              2.0f * kPi * (static_cast<float>(k) + radicalInverse(i, 7)) / static_cast<float>(kDirections);
          const Vec3 forward(std::cos(pitch) * std::cos(yaw), std::sin(pitch), std::cos(pitch) * std::sin(yaw));
          candidates.push_back({cameraLookingAt(eye, eye + forward, kInsideFov)});
        }
    }
    return candidates;
  }

  void addOutside(std::vector<Candidate>& candidates) const {
    const Vec3 center = 0.5f * (least_ + most_);
    const float distance = 0.5f * size_ / std::tan(0.5f * kOutsideFov) * 0.85f;
    for (float elevation : {0.02f, 0.3f, 0.6f})
      for (int k = 0; k < 16; ++k) {
        const float azimuth = 2.0f * kPi * static_cast<float>(k) / 16.0f;
        const Vec3 away(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                        std::cos(elevation) * std::cos(azimuth));
        candidates.push_back({cameraLookingAt(center + distance * away, center, kOutsideFov)});
      }
  }

  void score(std::vector<Candidate>& candidates, int columns, int rows) const {
    parallelFor(candidates.size(), 8, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) candidates[i].score = scoreOf(candidates[i].camera, columns, rows);
    });
  }

  double scoreOf(const Camera& camera, int columns, int rows) const {
    const float tangent = std::tan(0.5f * camera.yFov);
    const Mat3 turn(camera.worldFromCamera);
    const Vec3 origin(camera.worldFromCamera[3]);
    double sky = 0.0, back = 0.0, near = 0.0, dark = 0.0;
    std::map<int, double> brightness, depth, primitives;
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x) {
        const float u =
            (2.0f * (static_cast<float>(x) + 0.5f) / static_cast<float>(columns) - 1.0f) * aspect_ * tangent;
        const float v = (1.0f - 2.0f * (static_cast<float>(y) + 0.5f) / static_cast<float>(rows)) * tangent;
        const Sighting seen = compositor_.look(origin, glm::normalize(turn * Vec3(u, v, -1.0f)));
        if (seen.throughBack) ++back;
        if (!seen.surface) {
          ++sky;
          continue;
        }
        if (seen.distance < 0.02f * size_) ++near;
        const float light = luminance(seen.radiance);
        if (light < kDarkShare * meanLight_) ++dark;
        // Half stops of brightness, octaves of distance.
        ++brightness[static_cast<int>(std::floor(2.0f * std::log2(std::max(light, 1e-6f))))];
        ++depth[static_cast<int>(std::floor(std::log2(std::max(seen.distance / size_, 1e-6f))))];
        ++primitives[seen.primitive];
      }
    const double total = static_cast<double>(columns) * static_cast<double>(rows);
    if (sky == total) return -1e6;
    const double skyExcess = std::max(0.0, sky / total - 0.3);
    return entropy(brightness, total) + 0.6 * entropy(depth, total) + 0.3 * entropy(primitives, total) -
           3.0 * skyExcess - 4.0 * back / total - 3.0 * near / total - 3.0 * dark / total;
  }

  /// In nats, of counts that sum to at most `total`.
  static double entropy(const std::map<int, double>& counts, double total) {
    double sum = 0.0;
    for (const auto& [bin, count] : counts) sum -= count / total * std::log(count / total);
    return sum;
  }

  static constexpr float kDarkShare = 0.02f;
  const Compositor& compositor_;
  const float aspect_;
  const Vec3 least_;
  const Vec3 most_;
  const float size_;
  const float meanLight_ = luminance(compositor_.meanLight());
};

}  // namespace

Camera cameraLookingAt(const Vec3& position, const Vec3& target, float yFov) {
  const Vec3 back = glm::normalize(position - target);
  const Vec3 up = std::abs(back.y) > 0.999f ? Vec3(0, 0, 1) : Vec3(0, 1, 0);
  const Vec3 right = glm::normalize(glm::cross(up, back));
  Camera camera;
  camera.name = "auto";
  camera.worldFromCamera = Mat4(Vec4(right, 0), Vec4(glm::cross(back, right), 0), Vec4(back, 0), Vec4(position, 1));
  camera.yFov = yFov;
  return camera;
}

Camera chooseViewpoint(const Compositor& compositor, float aspect) { return Chooser(compositor, aspect).choose(); }

}  // namespace lumel
