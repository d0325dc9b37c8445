#include "baker/stills/viewpoint.h"

#include <algorithm>
#include <array>
#include <map>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr float kInsideFov = 0.95f;  // radians, vertical: a wide view of a room
constexpr float kOutsideFov = 0.65f;
constexpr int kPlaces = 400;
constexpr int kDirections = 12;
constexpr std::array<float, 2> kPitches = {-0.06f, -0.25f};  // radians: eyes rest a little below the horizon

struct Candidate {
  Camera camera;
  bool outside = false;
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
    std::vector<Candidate> candidates = best(inside());
    const std::vector<Candidate> outer = outside();
    candidates.insert(candidates.end(), outer.begin(), outer.end());
    score(candidates, 64, 36);
    return std::max_element(candidates.begin(), candidates.end(),
                            [](const Candidate& a, const Candidate& b) { return a.score < b.score; })
        ->camera;
  }

 private:
  static constexpr float kDarkShare = 0.06f;
  // What a view of the whole scene must be better by: it shows more parts than any one room, but none of them as near.
  static constexpr double kOutsidePenalty = 0.65;

  std::vector<Candidate> inside() const {
    std::vector<Candidate> candidates;
    for (unsigned i = 1; i <= kPlaces; ++i) {
      const Vec3 share(radicalInverse(i, 2), radicalInverse(i, 3), radicalInverse(i, 5));
      const Vec3 start = least_ + share * (most_ - least_);
      const Sighting floor = compositor_.look(start, Vec3(0, -1, 0));
      if (!floor.surface || floor.behind) continue;  // tools make all double-sided: from behind it is inside of a thing
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

  bool isDark(const Sighting& seen) const { return luminance(seen.radiance) < kDarkShare * meanLight_; }

  std::vector<Candidate> outside() const {
    std::vector<Candidate> candidates;
    const Vec3 center = 0.5f * (least_ + most_);
    for (float elevation : {0.02f, 0.3f, 0.6f})
      for (int k = 0; k < 16; ++k) {
        const float azimuth = 2.0f * kPi * static_cast<float>(k) / 16.0f;
        const Vec3 away(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                        std::cos(elevation) * std::cos(azimuth));
        candidates.push_back({cameraLookingAt(center + fittingDistance(away) * away, center, kOutsideFov), true});
      }
    return candidates;
  }

  /// How far from the middle, towards unit `away`, an eye sees all corners of the scene's box.
  float fittingDistance(const Vec3& away) const {
    const Mat3 turn(cameraLookingAt(away, Vec3(0.0f), kOutsideFov).worldFromCamera);
    const float tangent = std::tan(0.5f * kOutsideFov);
    float distance = 0.0f;
    for (unsigned corner = 0; corner < 8; ++corner) {
      const Vec3 sides(corner & 1u ? 0.5f : -0.5f, corner & 2u ? 0.5f : -0.5f, corner & 4u ? 0.5f : -0.5f);
      const Vec3 p = glm::transpose(turn) * (sides * (most_ - least_));
      distance = std::max(distance, p.z + std::max(std::abs(p.x) / aspect_, std::abs(p.y)) / tangent);
    }
    return 1.05f * distance;
  }

  /// The best by a coarse grid of rays.
  std::vector<Candidate> best(std::vector<Candidate> candidates) const {
    constexpr std::size_t kKept = 12;
    score(candidates, 16, 9);
    // Stable order for equal scores: the choice must not depend on the library's sort.
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    if (candidates.size() > kKept) candidates.resize(kKept);
    return candidates;
  }

  void score(std::vector<Candidate>& candidates, int columns, int rows) const {
    parallelFor(candidates.size(), 8, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) candidates[i].score = scoreOf(candidates[i], columns, rows);
    });
  }

  /// Viewpoint entropy (Vazquez et al. 2001) over patches of the scene, here cells of a grid split by the way they
  /// face: high where many parts show at similar sizes. Variety of brightness is left out: it would reward noise.
  double scoreOf(const Candidate& candidate, int columns, int rows) const {
    const Camera& camera = candidate.camera;
    const float tangent = std::tan(0.5f * camera.yFov);
    const Mat3 turn(camera.worldFromCamera);
    const Vec3 origin(camera.worldFromCamera[3]);
    double sky = 0.0, back = 0.0, near = 0.0, dark = 0.0;
    std::map<std::array<int, 4>, double> patches;
    std::map<int, double> depth, primitives, facings;
    double stops = 0.0;  // below the mean light of the bake, summed
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x) {
        const float u =
            (2.0f * (static_cast<float>(x) + 0.5f) / static_cast<float>(columns) - 1.0f) * aspect_ * tangent;
        const float v = (1.0f - 2.0f * (static_cast<float>(y) + 0.5f) / static_cast<float>(rows)) * tangent;
        const Vec3 direction = glm::normalize(turn * Vec3(u, v, -1.0f));
        const Sighting seen = compositor_.look(origin, direction);
        if (seen.throughBack) ++back;
        if (!seen.surface) {
          ++sky;
          continue;
        }
        if (seen.distance < 0.02f * size_) ++near;
        const float brightness = luminance(seen.radiance);
        if (isDark(seen)) ++dark;
        stops += std::clamp(std::log2(meanLight_ / std::max(brightness, 1e-6f * meanLight_)), 0.0f, 6.0f);
        ++depth[static_cast<int>(std::floor(std::log2(std::max(seen.distance / size_, 1e-6f))))];
        const std::array<int, 4> patch = patchOf(origin + seen.distance * direction, seen);
        ++patches[patch];
        ++facings[patch[3]];
        ++primitives[seen.primitive];
      }
    const double total = static_cast<double>(columns) * static_cast<double>(rows);
    if (sky == total) return -1e6;
    const double allowedSky = candidate.outside ? 1.0 : compositor_.hasSky() ? 0.3 : 0.1;
    const double skyExcess = std::max(0.0, sky / total - allowedSky);
    // From outside the whole scene fits the picture, however much sky is about it.
    const double counted = candidate.outside ? total - sky : total;
    return entropy(patches, counted) + 0.5 * entropy(depth, counted) + 0.5 * entropy(primitives, counted) +
           entropy(facings, counted) - 0.08 * stops / counted - 3.0 * skyExcess - 4.0 * back / counted -
           3.0 * near / total - 2.0 * dark / counted - (candidate.outside ? kOutsidePenalty : 0.0);
  }

  /// Grid cell and the axis that the surface faces most.
  std::array<int, 4> patchOf(const Vec3& position, const Sighting& seen) const {
    constexpr float kCells = 12.0f;
    const Vec3 cell = glm::floor((position - least_) / size_ * kCells);
    const Vec3 n = glm::abs(seen.normal);
    const int axis = n.x >= n.y && n.x >= n.z ? 0 : n.y >= n.z ? 1 : 2;
    return {static_cast<int>(cell.x), static_cast<int>(cell.y), static_cast<int>(cell.z),
            axis * 2 + (seen.normal[axis] < 0.0f ? 1 : 0)};
  }

  /// Entropy in nats of counts that sum to at most `total`.
  template <class Key>
  static double entropy(const std::map<Key, double>& counts, double total) {
    double sum = 0.0;
    for (const auto& [bin, count] : counts) sum -= count / total * std::log(count / total);
    return sum;
  }

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
