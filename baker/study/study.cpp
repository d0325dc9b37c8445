#include "baker/study/study.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "baker/bake/finish.h"
#include "baker/bake/quality.h"
#include "baker/light/lit_scene.h"
#include "baker/study/study_density.h"
#include "baker/study/study_maps.h"
#include "baker/study/study_setup.h"
#include "lightmap/texels/texels.h"
#include "scene/base/stopwatch.h"

namespace lumel {
namespace {

/// Candidates have options.seed; these are far from any that people choose.
constexpr std::uint64_t kReferenceSeed = 0x9e3779b97f4a7c15ull;
constexpr std::array<int, 2> kPilotSamples = {4, 16};
constexpr int kLeastReference = 64;
constexpr int kMostReference = 1 << 16;
/// The reference's share of the time: its error should be well below that of the best candidate.
constexpr double kReferenceShare = 0.5;
/// A candidate of the path series has at most a sixteenth of the samples of a half of the reference: a quarter of its
/// error at least lies beyond.
constexpr int kReferenceLead = 16;
/// Light below this share of the mean is darkness, of which a relative error says nothing.
constexpr double kLit = 1e-3;
constexpr std::array<float, 3> kDensities = {0.25f, 0.5f, 1.0f};

constexpr double kProgressPerSecond = 1e3;

/// Makes a bake advance the whole study by the time that it was expected to take.
class ShareOfProgress : public Progress {
 public:
  ShareOfProgress(Progress& outer, double seconds)
      : outer_(outer), units_(static_cast<std::uint64_t>(seconds * kProgressPerSecond)) {}
  ~ShareOfProgress() override { advanceTo(total_); }
  void begin(std::string_view, std::uint64_t totalWork) override { total_ = std::max<std::uint64_t>(1, totalWork); }
  void advance(std::uint64_t work) override {
    const std::uint64_t before = done_.fetch_add(work);
    outer_.advance(unitsAt(before + work) - unitsAt(before));
  }
  bool cancelled() const override { return outer_.cancelled(); }

 private:
  std::uint64_t unitsAt(std::uint64_t work) const {
    return static_cast<std::uint64_t>(static_cast<double>(units_) *
                                      std::min(1.0, static_cast<double>(work) / static_cast<double>(total_)));
  }
  void advanceTo(std::uint64_t work) {
    if (work > done_) advance(work - done_);
  }

  Progress& outer_;
  std::uint64_t units_;
  std::uint64_t total_ = 1;
  std::atomic<std::uint64_t> done_{0};
};

class Studying {
 public:
  Studying(const Scene& scene, const StudyOptions& options, Progress& progress)
      : scene_(scene), options_(options), progress_(progress) {}

  Expected<Study> run();

 private:
  struct Candidate {
    StudyPoint point;
    float density = 1.0f;   // factor on the reference's
    double expected = 0.0;  // seconds
  };
  struct Cost {
    double fixed = 0.0;  // seconds
    double perSample = 0.0;
  };
  struct Baked {
    BakeResult result;
    double seconds = 0.0;
    double cpuSeconds = 0.0;
  };

  Expected<Baked> bakeOnce(const Atlas& atlas, const std::vector<PageTexels>& texels, const BakeOptions& options,
                           double expected);
  Expected<void> makeAtlas();
  Expected<void> pilot();
  Expected<int> planReference() const;
  Expected<void> makeReference();
  std::vector<Candidate> candidates() const;
  Expected<void> measure(Candidate& candidate);
  Expected<void> measureDensity(Candidate& candidate);
  void measureDenoised(std::vector<BakedPage>& pages, StudyPoint point);
  void compare(const std::vector<BakedPage>& pages, StudyPoint& point) const;
  void sortPoints();
  double secondsFor(Integrator integrator, int samples) const {
    const Cost& cost = costs_[static_cast<std::size_t>(integrator)];
    return cost.fixed + cost.perSample * samples;
  }
  BakeOptions optionsFor(const StudyPoint& point) const {
    return {.integrator = point.integrator,
            .samples = point.samples,
            .bounces = options_.bounces,
            .seed = options_.seed,
            .encoding = rnmEncoding(point.projection)};
  }

  const Scene& scene_;
  std::unique_ptr<LitScene> lit_;  // made for the first bake and used by all
  StudyOptions options_;
  Progress& progress_;
  const Stopwatch sinceStart_;
  Atlas atlas_;
  bool ownUvs_ = false;  // of the scene
  std::vector<PageTexels> texels_;
  StudyMask mask_;
  StudyMaps truth_;
  double flatNoise_ = 0.0;  // mean square of the reference's own error
  double rnmNoise_ = 0.0;
  std::array<Cost, 2> costs_{};  // by integrator
  Study study_;
};

Expected<Studying::Baked> Studying::bakeOnce(const Atlas& atlas, const std::vector<PageTexels>& texels,
                                             const BakeOptions& options, double expected) {
  ShareOfProgress share(progress_, expected);
  const double cpu = cpuSecondsNow();
  if (!lit_) {
    auto lit = LitScene::build(scene_, options_.bounces != 0);
    if (!lit) return lit.error();
    lit_ = *std::move(lit);
  }
  auto result = bake(*lit_, atlas, texels, options, share);
  if (!result) return result.error();
  Baked baked{std::move(*result), 0.0, cpuSecondsNow() - cpu};
  baked.seconds = baked.result.stats.seconds;
  return baked;
}

/// How long bakes take: a line through two small ones of either integrator.
Expected<void> Studying::pilot() {
  for (const Integrator integrator : {Integrator::Gather, Integrator::Path}) {
    std::array<double, kPilotSamples.size()> seconds{};
    for (std::size_t i = 0; i < kPilotSamples.size(); ++i) {
      auto baked = bakeOnce(atlas_, texels_, optionsFor({.integrator = integrator, .samples = kPilotSamples[i]}), 0.0);
      if (!baked) return baked.error();
      seconds[i] = baked->seconds;
    }
    Cost& cost = costs_[static_cast<std::size_t>(integrator)];
    cost.perSample = std::max(seconds[1] - seconds[0], 0.25 * seconds[1]) / (kPilotSamples[1] - kPilotSamples[0]);
    cost.fixed = std::max(0.0, seconds[0] - cost.perSample * kPilotSamples[0]);
  }
  return {};
}

/// How many samples each half of the reference gets.
Expected<int> Studying::planReference() const {
  if (options_.referenceSamples > 0) return options_.referenceSamples;
  const double share = options_.timeBudgetSeconds > 0.0 ? options_.timeBudgetSeconds * kReferenceShare : HUGE_VAL;
  const auto secondsOfBoth = [&](int samples) { return 2.0 * secondsFor(Integrator::Path, samples); };
  int samples = kLeastReference;
  while (samples < kMostReference && secondsOfBoth(2 * samples) <= share) samples *= 2;
  if (secondsOfBoth(samples) > options_.timeBudgetSeconds && options_.timeBudgetSeconds > 0.0)
    return usageError("--time-budget: a reference of only 2 x " + std::to_string(samples) +
                      " samples would take about " + std::to_string(static_cast<int>(secondsOfBoth(samples)) + 1) +
                      " s; give more time, or fewer texels (--page-size, --texels-per-meter)");
  return samples;
}

Expected<void> Studying::makeReference() {
  StudyReference& reference = study_.reference;
  std::array<StudyMaps, 2> halves;
  for (std::size_t half = 0; half < 2; ++half) {
    BakeOptions options =
        optionsFor({.integrator = Integrator::Path, .projection = options_.projection, .samples = reference.samples});
    options.seed = options_.seed + kReferenceSeed * (half + 1);
    auto baked = bakeOnce(atlas_, texels_, options, secondsFor(Integrator::Path, reference.samples));
    if (!baked) return baked.error();
    if (half == 0) mask_ = validTexels(baked->result.pages);
    halves[half] = mapsOf(baked->result.pages, mask_);
    reference.seconds += baked->seconds;
    reference.cpuSeconds += baked->cpuSeconds;
    reference.rays += baked->result.stats.rays + baked->result.stats.shadowRays;
  }
  // Half of the difference of two independent halves has the variance of their mean.
  flatNoise_ = differenceOf(halves[0].flat, halves[1].flat).square / 4.0;
  const std::size_t mapCount = halves[0].maps.size();
  for (std::size_t k = 0; k < mapCount; ++k)
    rnmNoise_ += differenceOf(halves[0].maps[k], halves[1].maps[k]).square / (4.0 * static_cast<double>(mapCount));
  truth_ = std::move(halves[0]);
  const auto average = [](std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] = 0.5f * (a[i] + b[i]);
  };
  average(truth_.flat, halves[1].flat);
  const auto averageErrors = [](std::vector<float>& a, const std::vector<float>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] = 0.5f * std::hypot(a[i], b[i]);
  };
  averageErrors(truth_.standardError, halves[1].standardError);
  for (std::size_t k = 0; k < mapCount; ++k) averageErrors(truth_.mapErrors[k], halves[1].mapErrors[k]);
  for (std::size_t k = 0; k < mapCount; ++k) average(truth_.maps[k], halves[1].maps[k]);
  reference.meanFlat = meanOf(truth_.flat);
  if (!(reference.meanFlat > 0.0))
    return inputError("nothing in the scene is lit, so there is no error to study; give --sky-color or --sky");
  reference.flatError = std::sqrt(flatNoise_) / reference.meanFlat;
  double rnmMean = 0.0;
  for (const std::vector<Vec3>& map : truth_.maps) rnmMean += meanOf(map) / static_cast<double>(mapCount);
  reference.rnmError = std::sqrt(rnmNoise_) / rnmMean;
  return {};
}

std::vector<Studying::Candidate> Studying::candidates() const {
  std::vector<Candidate> all;
  const auto add = [&](StudyPoint point, float density) {
    point.quality = point.integrator == Integrator::Gather && point.series == "gather" ? qualityOf(point.samples) : "";
    const double expected = secondsFor(point.integrator, point.samples) * static_cast<double>(density * density);
    all.push_back({std::move(point), density, expected});
  };
  const int usual = std::min(options_.mostSamples, samplesOf(Quality::Production));
  const auto addGather = [&](int samples) {
    add({.series = "gather", .projection = options_.projection, .samples = samples}, 1.0f);
  };
  // What says most for its time comes first: the budget may end.
  int gather = kStudyLeastSamples;
  for (; gather <= usual; gather *= 2) addGather(gather);
  for (const Projection projection : {Projection::Raw, Projection::Flat, Projection::Fit, Projection::Signed})
    add({.series = "projection", .projection = projection, .samples = usual}, 1.0f);
  for (const float density : kDensities)
    add({.series = "density", .projection = options_.projection, .samples = usual}, density);
  const int mostPath = std::max(kStudyLeastSamples, study_.reference.samples / kReferenceLead);
  for (int samples = kStudyLeastSamples; samples <= mostPath; samples *= 4)
    add({.series = "path", .integrator = Integrator::Path, .projection = options_.projection, .samples = samples},
        1.0f);
  for (; gather <= options_.mostSamples; gather *= 2) addGather(gather);
  return all;
}

void Studying::compare(const std::vector<BakedPage>& pages, StudyPoint& point) const {
  const StudyMaps maps = mapsOf(pages, mask_);
  const double mean = study_.reference.meanFlat;
  const auto errorOf = [](double square, double noise, double bias, double level) {
    return MapError{std::sqrt(std::max(0.0, square - noise)) / level, bias / level};
  };
  const MapDifference flat = differenceOf(maps.flat, truth_.flat);
  point.flat = errorOf(flat.square, flatNoise_, flat.mean, mean);
  MapDifference rnm;
  double rnmMean = 0.0;
  const auto mapCount = static_cast<double>(maps.maps.size());
  for (std::size_t k = 0; k < maps.maps.size(); ++k) {
    const MapDifference d = differenceOf(maps.maps[k], truth_.maps[k]);
    rnm.square += d.square / mapCount;
    rnm.mean += d.mean / mapCount;
    rnmMean += meanOf(truth_.maps[k]) / mapCount;
  }
  point.rnm = errorOf(rnm.square, rnmNoise_, rnm.mean, rnmMean);
  const WithinInterval flatWithin =
      withinInterval(maps.flat, maps.standardError, truth_.flat, truth_.standardError, kLit * mean);
  WithinInterval rnmWithin;
  for (std::size_t k = 0; k < maps.maps.size(); ++k)
    rnmWithin += withinInterval(maps.maps[k], maps.mapErrors[k], truth_.maps[k], truth_.mapErrors[k], kLit * mean);
  point.withinInterval = flatWithin.share();
  point.withinRnm = rnmWithin.share();
  point.claimed =
      std::sqrt(flatWithin.claimed / static_cast<double>(std::max<std::size_t>(1, maps.flat.size()))) / mean;
  point.hasMaps = true;
}

Expected<void> Studying::measure(Candidate& candidate) {
  StudyPoint& point = candidate.point;
  if (point.series == "density") return measureDensity(candidate);
  auto baked = bakeOnce(atlas_, texels_, optionsFor(point), candidate.expected);
  if (!baked) return baked.error();
  point.texelsPerMeter = atlas_.texelsPerMeter;
  point.texels = baked->result.stats.texels;
  point.rays = baked->result.stats.rays + baked->result.stats.shadowRays;
  point.seconds = baked->seconds;
  point.cpuSeconds = baked->cpuSeconds;
  if (point.series == "projection")
    point.residual = baked->result.stats.projectionResidual;
  else
    compare(baked->result.pages, point);
  study_.points.push_back(point);
  if (point.series == "gather") measureDenoised(baked->result.pages, point);
  return {};
}

/// The same bake, denoised as for the files.
void Studying::measureDenoised(std::vector<BakedPage>& pages, StudyPoint point) {
  const Stopwatch stopwatch;
  const double cpu = cpuSecondsNow();
  finishPages(pages, atlas_, texels_, {.denoise = true});
  point.seconds += stopwatch.seconds();
  point.cpuSeconds += cpuSecondsNow() - cpu;
  point.series = "denoised";
  compare(pages, point);
  study_.points.push_back(point);
}

Expected<void> Studying::measureDensity(Candidate& candidate) {
  StudyPoint& point = candidate.point;
  AtlasOptions options = options_.atlas;
  if (ownUvs_)
    options.pageSize = std::max(4, static_cast<int>(static_cast<float>(options.pageSize) * candidate.density) / 4 * 4);
  else
    options.texelsPerMeter = atlas_.texelsPerMeter * candidate.density;
  ShareOfProgress quiet(progress_, 0.0);
  auto atlas = buildAtlas(scene_, options, quiet);
  if (!atlas && atlas.error().kind == ErrorKind::Interrupted) return atlas.error();
  if (!atlas) {
    study_.notes.push_back("density times " + std::to_string(candidate.density) +
                           " left out: " + atlas.error().message);
    return {};
  }
  const auto texels = findTexels(atlas->atlas);
  auto baked = bakeOnce(atlas->atlas, texels, optionsFor(point), candidate.expected);
  if (!baked) return baked.error();
  finishPages(baked->result.pages, atlas->atlas, texels, {.rings = std::max(1, (options.padding + 1) / 2)});
  const AtlasLookup lookup(atlas->atlas, baked->result.pages);

  double square = 0.0;
  std::size_t count = 0;
  std::size_t index = 0;  // into truth_, which goes page by page and row by row
  for (std::size_t p = 0; p < texels_.size(); ++p) {
    std::vector<std::uint32_t> texelAt(mask_[p].size());
    for (std::size_t i = 0; i < texels_[p].size(); ++i) {
      const TexelCoord at = texels_[p].coords[i];
      texelAt[static_cast<std::size_t>(at.y) * static_cast<std::size_t>(texels_[p].width) + at.x] =
          static_cast<std::uint32_t>(i);
    }
    TexelFootprint footprint;
    for (std::size_t i = 0; i < mask_[p].size(); ++i) {
      if (!mask_[p][i]) continue;
      const Vec3 truth = truth_.flat[index++];
      if (!(footprint.clip(atlas_, texels_[p], texelAt[i]) > 0.0)) continue;
      const auto seen = lookup.flatAt(atlas_, footprint.centroid());
      if (!seen) continue;
      const Vec3 d = *seen - truth;
      square += static_cast<double>(glm::dot(d, d)) / 3.0;
      ++count;
    }
  }
  point.texelsPerMeter = atlas->atlas.texelsPerMeter;
  point.texels = baked->result.stats.texels;
  point.rays = baked->result.stats.rays + baked->result.stats.shadowRays;
  point.seconds = baked->seconds;
  point.cpuSeconds = baked->cpuSeconds;
  point.seen = std::sqrt(std::max(0.0, square / static_cast<double>(std::max<std::size_t>(1, count)) - flatNoise_)) /
               study_.reference.meanFlat;
  study_.points.push_back(point);
  return {};
}

Expected<void> Studying::makeAtlas() {
  const int asked = options_.atlas.pageSize;
  ShareOfProgress quiet(progress_, 0.0);
  auto atlas = atlasThatFits(scene_, options_.atlas, quiet);
  if (!atlas) return atlas.error();
  if (options_.atlas.pageSize != asked)
    study_.notes.push_back("the charts do not fit a page of " + std::to_string(asked) + "; one of " +
                           std::to_string(options_.atlas.pageSize) + " is used");
  ownUvs_ = std::any_of(atlas->report.sceneUvs.begin(), atlas->report.sceneUvs.end(),
                        [](const UvReport& uv) { return uv.valid; }) &&
            options_.atlas.uvSource != UvSource::Generate;
  atlas_ = std::move(atlas->atlas);
  texels_ = findTexels(atlas_);
  study_.texelsPerMeter = atlas_.texelsPerMeter;
  for (const PageTexels& page : texels_) study_.texels += page.size();
  return {};
}

/// Sorts the points by series, in the order of the tables; within one they stay as they were measured.
void Studying::sortPoints() {
  const auto rank = [](const StudyPoint& p) {
    constexpr std::array<std::string_view, 5> kOrder = {"gather", "denoised", "path", "projection", "density"};
    return std::find(kOrder.begin(), kOrder.end(), p.series) - kOrder.begin();
  };
  std::stable_sort(study_.points.begin(), study_.points.end(),
                   [&](const StudyPoint& a, const StudyPoint& b) { return rank(a) < rank(b); });
}

Expected<Study> Studying::run() {
  if (auto done = makeAtlas(); !done) return done.error();
  if (auto done = pilot(); !done) return done.error();
  const auto samples = planReference();
  if (!samples) return samples.error();
  study_.reference.samples = *samples;
  std::vector<Candidate> all = candidates();
  const double budget = options_.timeBudgetSeconds > 0.0 ? options_.timeBudgetSeconds : HUGE_VAL;
  double expected = 2.0 * secondsFor(Integrator::Path, *samples);
  for (const Candidate& candidate : all)
    if (expected + candidate.expected <= budget) expected += candidate.expected;
  progress_.begin("study", static_cast<std::uint64_t>(kProgressPerSecond * expected));
  if (auto done = makeReference(); !done) return done.error();
  for (Candidate& candidate : all) {
    if (sinceStart_.seconds() + candidate.expected > budget) {
      study_.notes.push_back(candidate.point.series + " of " + std::to_string(candidate.point.samples) +
                             " samples left out: the time budget ends before");
      continue;
    }
    if (auto done = measure(candidate); !done) return done.error();
  }
  progress_.end();
  sortPoints();
  return std::move(study_);
}

}  // namespace

Expected<Study> study(const Scene& scene, const StudyOptions& options, Progress& progress) {
  return Studying(scene, options, progress).run();
}

}  // namespace lumel
