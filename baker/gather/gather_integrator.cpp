#include "baker/gather/gather_integrator.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "baker/rays/flush_denormals.h"
#include "scene/base/parallel.h"
#include "scene/base/stopwatch.h"

namespace lumel {
namespace {

/// Fewest samples after which an error estimate may end the work on a texel: two doublings.
constexpr std::uint32_t kFirstJudged = 32;
/// A wave that meets the target goes on with more than so many of the eight around it that do not (a straight border
/// has three): estimates scatter, and waves that stop by themselves would show as streaks in the sample counts.
constexpr std::ptrdiff_t kMostUnmetAround = 3;
/// Without a target a texel is done at kSettledError * N^kSettledRate times the root of its light and the mean light, N
/// being all samples: what is seen of an error goes with the root of the light, and a texel of mean light has about
/// this error after N samples. In the dark, where somebody may stand whose eyes have adapted, at no more than
/// kSettledInDark times as much relative to its light; below kSettledFloor of the mean it is night.
constexpr double kSettledError = 0.4;
constexpr double kSettledRate = -0.6;
constexpr double kSettledInDark = 5.0;
constexpr double kSettledFloor = 1e-3;
/// Calibrated: 93 to 97% of texels lie within 1.96 standard errors.
constexpr double kGatherCredit = 0.5;
/// Endless light: the warm-up ends where another bounce adds less than this share, or changes what all of them come to
/// by less; or after so many. No more than kMostBeyond of the light is from bounces that were not followed, since rooms
/// that are lit through others get theirs late; and none where each bounce has more than kSlowest of the light of the
/// one before.
constexpr double kSettled = 1e-4;
constexpr double kMostBeyond = 0.002;
constexpr double kSlowest = 0.98;
constexpr int kMostSweeps = 256;
constexpr std::size_t kSweepGrain = 4096;
constexpr std::size_t kWaveGrain = kSweepGrain / kLanes;
/// Whether more or less than half of a texel's rays meet backs is certain where the lead squared, in rays, is this many
/// times their number: 2.8 standard deviations of a fair coin, and what eight rays of eight have.
constexpr double kCertain = 8.0;
/// A texel more of which sees nothing but backs is invalid. Where its chart has no better ones it may be in a room that
/// is inside out, and all that it found counts.
constexpr float kMostInside = 0.6f;
/// Inside of something whose chart nobody sees texels darker than this share of the mean need no more samples.
constexpr double kDarkInside = 0.01;

float square(float x) { return x * x; }

CacheLevels levelsFor(int bounces) {
  if (bounces < 0) return {.count = 1, .base = 0, .endless = true};
  const int count = std::min(bounces, CacheLevels::kMost);
  return {.count = count, .base = bounces - count, .endless = false};
}

}  // namespace

void TexelLight::resize(std::size_t count) {
  flat.resize(count);
  for (std::vector<Vec3>& map : rnm) map.resize(count);
}

GatherIntegrator::GatherIntegrator(const LightTransport& transport, const RnmKernels& kernels, const Atlas& atlas,
                                   const std::vector<PageTexels>& texels, const GatherOptions& options)
    : options_(options),
      map_(transport.rays, atlas, texels),
      scene_{.transport = transport, .kernels = kernels, .atlas = atlas, .texels = texels, .map = map_} {
  scene_.seed = options.seed;
  scene_.bounces = options.bounces;
  scene_.indirectOnly = options.indirectOnly;
  scene_.lastDepth = options.bounces < 0 ? kLongestPath : options.bounces;
  scene_.levels = levelsFor(options.bounces);
  for (std::uint32_t p = 0; p < texels.size(); ++p) {
    firstWave_.push_back(waves_.size());
    for (std::size_t first = 0; first < texels[p].size(); first += kLanes)
      waves_.push_back({p, static_cast<std::uint32_t>(first),
                        static_cast<std::uint32_t>(std::min<std::size_t>(kLanes, texels[p].size() - first))});
  }
  if (!options.indirectOnly) scene_.strategies = lightStrategies(transport, true);
  std::size_t probes = 0;
  for (const PageTexels& page : texels) {
    firstProbe_.push_back(probes);
    probes += (page.size() + kProbeStride - 1) / kProbeStride;
  }
  probeCount_ = probes;
}

void GatherIntegrator::makeCache() {
  backFaces_.resize(map_.size());
  samplesOf_.resize(map_.size());
  buried_.resize(map_.size());
  warmBacks_.resize(map_.size());
  errors_.emplace(scene_.texels, kGatherCredit);
  if (scene_.levels.count == 0) return;
  reflectance_.resize(map_.size());
  if (!scene_.levels.endless) cache_.resize(map_.size() * stored());  // else it is what the warm-up ends with
  if (!scene_.indirectOnly) return;
  direct_.resize(map_.size());
  seen_.resize(map_.size());
}

/// After the warm-up, whose links are gone by then.
void GatherIntegrator::makeSums() {
  const std::size_t count = map_.size();
  sums_.resize(count);
  coverage_.resize(count);
  inside_.resize(count);
  if (!scene_.levels.endless) levelSums_.resize(count * stored());
  probes_.resize(probeCount_);
  if (!scene_.strategies.empty()) spreads_.resize(waves_.size() * (scene_.strategies.size() + 1));
}

/// What texel() does not need: its place is taken by the pages of the result.
void GatherIntegrator::dropCache() {
  reflectance_ = std::vector<PackedColor>();  // `= {}` would keep the memory
  cache_ = std::vector<PackedColor>();
  levelSums_ = std::vector<Vec3>();
  direct_ = std::vector<Vec3>();
  seen_ = std::vector<Vec3>();
  spreads_ = std::vector<LightSpread>();
  substitutes_ = std::vector<TexelMap::Substitute>();
  scene_.reflectance = {};
}

std::span<LightSpread> GatherIntegrator::spreadsOf(std::size_t wave) {
  if (spreads_.empty()) return {};
  const std::size_t sources = scene_.strategies.size() + 1;
  return std::span(spreads_).subspan(wave * sources, sources);
}

/// Calls body(wave index, GatheredWave&) for all waves; what they count is added up in their order.
template <class Body>
Expected<void> GatherIntegrator::forEachWave(Progress& progress, Body body) {
  struct Counts {
    std::uint64_t rays = 0;
    std::uint64_t shadowRays = 0;
    std::vector<NonFiniteSample> nonFinite;
  };
  std::vector<Counts> counts(waves_.size());
  parallelFor(waves_.size(), 1, [&](std::size_t first, std::size_t last) {
    const FlushDenormals flush;
    for (std::size_t w = first; w < last && !progress.cancelled(); ++w) {
      GatheredWave done;
      body(w, done);
      counts[w] = {done.rays, done.shadowRays, std::move(done.nonFinite)};
    }
  });
  if (progress.cancelled()) return interrupted();
  for (const Counts& c : counts) {
    rays_ += c.rays;
    shadowRays_ += c.shadowRays;
    nonFinite_.insert(nonFinite_.end(), c.nonFinite.begin(), c.nonFinite.end());
  }
  return {};
}

Expected<void> GatherIntegrator::run(Progress& progress) {
  const Stopwatch sinceStart;
  const auto least = static_cast<std::uint32_t>(options_.samples);
  const std::uint32_t samples =
      options_.targetError > 0.0f ? std::max(least, static_cast<std::uint32_t>(options_.maxSamples)) : least;
  progress.begin("bake", map_.size() * std::uint64_t{samples});
  makeCache();
  if (scene_.levels.count > 0)
    if (auto warm = warmUp(progress); !warm) return warm;
  makeSums();
  double secondsPerSample = 0.0;
  for (std::uint32_t first = 0; first < samples;) {
    const std::uint32_t end = std::min(samples, std::max(kFirstPass, 2 * first));
    const double began = sinceStart.seconds();
    if (options_.timeBudgetSeconds > 0.0 && first > 0 &&
        began + secondsPerSample * (end - first) > options_.timeBudgetSeconds)
      break;
    if (auto done = pass(first, end, progress); !done) return done;
    secondsPerSample = (sinceStart.seconds() - began) / (end - first);
    first = end;
    if (options_.targetError > 0.0f) {
      if (end >= std::max(kFirstJudged, least) && markDone() >= kTargetShare) break;
    } else if (options_.adaptive && end >= kFirstJudged && end < samples) {
      markDone();
    }
    if (scene_.levels.count > 0 && first < samples) renewCache();
  }
  dropCache();
  progress.end();
  return {};
}

Expected<void> GatherIntegrator::warmUp(Progress& progress) {
  const std::size_t count = map_.size();
  WarmLinks links(count, waves_.size());
  std::vector<Vec3> first(count);     // light that needs no texel to be known: direct, and what rays see shine
  std::vector<Vec3> constant(count);  // the same and light from hits without texels
  std::vector<std::uint8_t> uneven(count);
  auto traced = forEachWave(progress, [&](std::size_t w, GatheredWave& counts) {
    const Wave& wave = waves_[w];
    const std::size_t start = map_.firstOfPage(wave.page) + wave.first;
    const std::size_t linkCount = std::size_t{wave.count} * GatherWave::kWarmRays;
    GatherWave texels(scene_, wave.page, wave.first, wave.count);
    std::array<CacheLink, std::size_t{kLanes} * GatherWave::kWarmRays> found;
    const auto warm = texels.warmUp(std::span(found).first(linkCount), counts);
    links.keep(w, start * GatherWave::kWarmRays, std::span(found).first(linkCount));
    for (std::size_t i = 0; i < wave.count; ++i) {
      reflectance_[start + i] = packColor(warm[i].reflectance);
      first[start + i] = warm[i].direct + warm[i].seen;
      constant[start + i] = first[start + i] + warm[i].relit;
      warmBacks_[start + i] = static_cast<std::uint8_t>(warm[i].backs);
      backFaces_[start + i] = static_cast<std::uint32_t>(std::popcount(warm[i].backs));
      uneven[start + i] = warm[i].isUneven() ? 1 : 0;
      if (!scene_.indirectOnly) continue;
      direct_[start + i] = warm[i].direct;
      seen_[start + i] = warm[i].seen * static_cast<float>(GatherWave::kWarmRays);
    }
  });
  if (!traced) return traced;
  std::fill(samplesOf_.begin(), samplesOf_.end(), std::uint32_t{GatherWave::kWarmRays});
  findBuried();
  substituteInvalid();
  std::vector<PackedColor> reflected = solveLinks(links, std::move(first), constant);
  constant = std::vector<Vec3>();
  map_.setUneven(uneven);
  uneven = std::vector<std::uint8_t>();
  if (scene_.levels.endless) cache_ = std::move(reflected);
  scene_.reflectance = reflectance_;
  for (std::size_t t = 0; t < count; ++t)
    if (!buried_[t]) {
      backFaces_[t] = 0;
      samplesOf_[t] = 0;
    }
  return {};
}

std::vector<PackedColor> GatherIntegrator::solveLinks(const WarmLinks& links, std::vector<Vec3> light,
                                                      std::span<const Vec3> constant) {
  const CacheLevels& levels = scene_.levels;
  const std::size_t count = map_.size();
  // What links look up: one product instead of two values from all over the memory.
  std::vector<PackedColor> reflected(count);
  // And `beyond` times more of what the sweep added.
  const auto reflect = [&](float beyond) {
    for (const TexelMap::Substitute& s : substitutes_) light[s.texel] = light[s.source];
    parallelFor(count, kSweepGrain, [&](std::size_t first, std::size_t last) {
      for (std::size_t t = first; t < last; ++t) {
        Vec3 now = unpackColor(reflectance_[t]) * light[t];
        if (beyond > 0.0f) now += beyond * glm::max(now - unpackColor(reflected[t]), Vec3(0.0f));
        reflected[t] = packColor(now);
      }
    });
  };
  const auto keep = [&](int level) {
    for (std::size_t t = 0; t < count; ++t) cache_[t * stored() + static_cast<std::size_t>(level)] = reflected[t];
  };
  reflect(0.0f);
  if (!levels.endless && levels.base == 0) keep(0);
  const int sweeps = levels.endless ? kMostSweeps : levels.base + levels.count - 1;
  double before = 0.0, addedBefore = 0.0, limitBefore = 0.0;
  for (int sweep = 1; sweep <= sweeps; ++sweep) {
    std::vector<double> parts((waves_.size() + kWaveGrain - 1) / kWaveGrain);
    parallelFor(waves_.size(), kWaveGrain, [&](std::size_t first, std::size_t last) {
      double sum = 0.0;
      for (std::size_t w = first; w < last; ++w) {
        const std::size_t start = map_.firstOfPage(waves_[w].page) + waves_[w].first;
        WarmLinks::Reader link(links, w, start * GatherWave::kWarmRays);
        for (std::size_t t = start; t < start + waves_[w].count; ++t) {
          Vec3 found(0.0f);
          for (int ray = 0; ray < GatherWave::kWarmRays; ++ray, link.next())
            if (link.isTexel()) found += link.lightOf(reflected);
          light[t] = constant[t] + found / static_cast<float>(GatherWave::kWarmRays);
          sum += static_cast<double>(luminance(light[t]));
        }
      }
      parts[first / kWaveGrain] = sum;
    });
    double total = 0.0;
    for (const double part : parts) total += part;
    // In the end every sweep adds the same share of what the one before it did, and the rest is a geometric series.
    const double added = total - before;
    const double ratio = addedBefore > 0.0 ? std::clamp(added / addedBefore, 0.0, kSlowest) : kSlowest;
    const double rest = added * ratio / (1.0 - ratio);
    const bool known = rest <= kMostBeyond * total && std::abs(total + rest - limitBefore) <= kSettled * total;
    const bool settled = levels.endless && (known || added <= kSettled * total);
    reflect(settled && known ? static_cast<float>(ratio / (1.0 - ratio)) : 0.0f);
    if (settled) break;
    if (!levels.endless && sweep >= levels.base) keep(sweep - levels.base);
    before = total;
    addedBefore = added;
    limitBefore = total + rest;
  }
  return reflected;
}

Expected<void> GatherIntegrator::pass(std::uint32_t first, std::uint32_t end, Progress& progress) {
  auto traced = forEachWave(progress, [&](std::size_t w, GatheredWave& done) {
    const Wave& wave = waves_[w];
    const std::uint64_t samples = std::uint64_t{wave.count} * (end - first);
    if (wave.done) {
      progress.advance(samples);
      return;
    }
    const std::size_t start = map_.firstOfPage(wave.page) + wave.first;
    const std::span buried = std::span(buried_).subspan(start, wave.count);
    if (first == 0 || std::ranges::count(buried, 0) > 0) {
      GatherWave texels(scene_, wave.page, wave.first, wave.count);
      texels.gather(first, end, cache_, buried, spreadsOf(w), done);
      for (std::size_t i = 0; i < wave.count; ++i) coverage_[start + i] = texels.coverage(i);
    }
    store(w, done, first, end);
    progress.advance(samples);
  });
  if (!traced) return traced;
  if (first == 0) warmBacks_ = std::vector<std::uint8_t>();
  findBuried();
  estimateErrors();
  return {};
}

void GatherIntegrator::store(std::size_t index, const GatheredWave& done, std::uint32_t first, std::uint32_t end) {
  Wave& wave = waves_[index];
  wave.moved = {};
  std::array<float, kLanes> before{};
  std::array<float, kLanes> now{};
  std::uint32_t leftOut = 0;
  const std::size_t start = map_.firstOfPage(wave.page) + wave.first;
  for (std::size_t i = 0; i < wave.count; ++i) {
    const GatheredTexel& texel = done.texels[i];
    if (buried_[start + i]) {
      leftOut |= 1u << i;
      continue;
    }
    samplesOf_[start + i] = end;
    Vec3& flat = sums_.flat[start + i];
    before[i] = luminance(flat) / static_cast<float>(std::max(1u, first));
    flat += Vec3(texel.flat);
    if (!seen_.empty()) seen_[start + i] += Vec3(texel.seen);
    now[i] = luminance(flat) / static_cast<float>(end);
    wave.moved[0] += square(now[i] - before[i]);
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3& sum = sums_.rnm[k][start + i];
      const float mean = luminance(sum) / static_cast<float>(std::max(1u, first));
      sum += Vec3(texel.rnm[k]);
      wave.moved[k + 1] += square(luminance(sum) / static_cast<float>(end) - mean);
    }
    if (!scene_.levels.endless)
      for (std::size_t l = 0; l < stored(); ++l) levelSums_[(start + i) * stored() + l] += Vec3(texel.levels[l]);
    backFaces_[start + i] += texel.backFaces;
    // The warm-up's rays and the first samples come from the same points.
    if (first == 0 && end >= GatherWave::kWarmRays && stored() > 0)
      inside_[start + i].addPairs(warmBacks_[start + i], texel.firstBacks);
    inside_[start + i].add(texel.inside);
    if ((wave.first + i) % kProbeStride == 0)
      for (std::size_t k = 0; k < kProbeNormals; ++k)
        probes_[probeOf(wave.page, wave.first + i)][k] += Vec3(texel.probes[k]);
  }
  errors_->add(index, before, now, first, end - first, leftOut);
}

float GatherIntegrator::weightOf(std::size_t texel) const {
  const auto samples = static_cast<float>(std::max(1u, samplesOf_[texel]));
  const float inside = inside_[texel].share() * static_cast<float>(backFaces_[texel]);
  return inside > kMostInside * samples ? samples : samples - inside;
}

void GatherIntegrator::substituteInvalid() {
  std::vector<std::uint8_t> valid(map_.size());
  std::vector<std::uint8_t> wanting(map_.size());
  for (std::size_t t = 0; t < valid.size(); ++t) {
    valid[t] = 2 * backFaces_[t] <= samplesOf_[t] ? 1 : 0;
    // Of texels wholly inside only rays from inside see anything, and these must not bring the light out there to
    // texels that are partly in the open.
    wanting[t] = 16.0 * backFaces_[t] < 15.0 * samplesOf_[t] ? 1 : 0;
  }
  substitutes_ = map_.substitutes(wanting, valid);
}

void GatherIntegrator::findBuried() {
  std::vector<std::uint8_t> hidden(map_.size());
  std::vector<std::uint8_t> valid(map_.size());
  for (std::size_t t = 0; t < valid.size(); ++t) {
    const double lead = 2.0 * backFaces_[t] - samplesOf_[t];  // of rays that meet backs
    const bool certain = lead * lead >= kCertain * samplesOf_[t];
    hidden[t] = certain && lead > 0.0 ? 1 : 0;
    valid[t] = certain && lead < 0.0 ? 1 : 0;
  }
  const std::vector<std::uint8_t> replaced = map_.buried(hidden, valid);
  const double dark = darkFloor(kDarkInside);
  for (std::size_t t = 0; t < buried_.size(); ++t) {
    const bool judged = hidden[t] && samplesOf_[t] >= kFirstJudged;
    if (replaced[t] || (judged && static_cast<double>(luminance(meanLight(t))) < dark)) buried_[t] = 1;
  }
}

double GatherIntegrator::darkFloor(double share) const {
  double total = 0.0;
  if (!sums_.flat.empty())
    for (std::size_t t = 0; t < map_.size(); ++t) total += static_cast<double>(luminance(meanLight(t)));
  return share * total / static_cast<double>(std::max<std::size_t>(1, map_.size()));
}

Vec3 GatherIntegrator::lightOf(std::size_t texel, std::size_t level) const {
  const Vec3& sum = scene_.levels.endless ? sums_.flat[texel] : levelSums_[texel * stored() + level];
  const Vec3 gathered = sum / weightOf(texel);
  if (!scene_.indirectOnly) return gathered;
  return gathered + direct_[texel] + seen_[texel] / (static_cast<float>(GatherWave::kWarmRays) + weightOf(texel));
}

void GatherIntegrator::renewCache() {
  substituteInvalid();
  // The lowest level stays as the warm-up left it where it stands on others that are not kept.
  const std::size_t firstLevel = scene_.levels.base > 0 ? 1 : 0;
  parallelFor(map_.size(), kSweepGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t)
      for (std::size_t l = firstLevel; l < stored(); ++l)
        cache_[t * stored() + l] = packColor(unpackColor(reflectance_[t]) * lightOf(t, l));
  });
  for (const TexelMap::Substitute& s : substitutes_)
    for (std::size_t l = firstLevel; l < stored(); ++l)
      cache_[s.texel * stored() + l] = packColor(unpackColor(reflectance_[s.texel]) * lightOf(s.source, l));
}

void GatherIntegrator::estimateErrors() {
  std::vector<std::uint8_t> live(waves_.size());
  for (std::size_t w = 0; w < waves_.size(); ++w) live[w] = waves_[w].done ? 0 : 1;
  errors_->endPass(live);
}

float GatherIntegrator::errorOf(std::size_t wave, std::size_t i) const {
  const std::size_t t = map_.firstOfPage(waves_[wave].page) + waves_[wave].first + i;
  return errors_->standardError(wave, i) * static_cast<float>(samplesOf_[t]) / weightOf(t);
}

double GatherIntegrator::worstByFlat(std::size_t wave) const {
  std::array<double, 4> moved{};
  for (const std::uint32_t near : errors_->around(wave))
    if (near != DoublingError::kNone)
      for (std::size_t map = 0; map < moved.size(); ++map) moved[map] += static_cast<double>(waves_[near].moved[map]);
  return moved[0] > 0.0 ? std::sqrt(std::ranges::max(moved) / moved[0]) : 1.0;
}

double GatherIntegrator::markDone() {
  const std::size_t count = map_.size();
  const double mean = darkFloor(1.0);
  const double settled = kSettledError * std::pow(static_cast<double>(options_.samples), kSettledRate);
  const auto goal = [&](double light) {
    if (options_.targetError > 0.0f)
      return static_cast<double>(options_.targetError) * std::max(light, kDarkFloor * mean);
    light = std::max(light, kSettledFloor * mean);
    return settled * std::min(std::sqrt(light * mean), kSettledInDark * light);
  };
  std::size_t met = 0;
  std::vector<std::uint8_t> meets(waves_.size());
  for (std::size_t w = 0; w < waves_.size(); ++w) {
    const Wave& wave = waves_[w];
    const std::size_t start = map_.firstOfPage(wave.page) + wave.first;
    const double worst = worstByFlat(w);
    std::size_t metHere = 0;
    for (std::size_t i = 0; i < wave.count; ++i) {
      const std::size_t t = start + i;
      const bool inside = options_.targetError > 0.0f && 2 * backFaces_[t] > samplesOf_[t];
      metHere +=
          inside || worst * static_cast<double>(errorOf(w, i)) <= goal(static_cast<double>(luminance(meanLight(t))));
    }
    meets[w] = wave.done || metHere == wave.count;
    met += metHere;
  }
  for (std::size_t w = 0; w < waves_.size(); ++w)
    waves_[w].done = meets[w] && (waves_[w].done || std::ranges::count_if(errors_->around(w), [&](std::uint32_t near) {
                                                      return near != DoublingError::kNone && !meets[near];
                                                    }) <= kMostUnmetAround);
  return count == 0 ? 1.0 : static_cast<double>(met) / static_cast<double>(count);
}

TexelLight GatherIntegrator::takeLight() {
  TexelLight light = std::move(sums_);
  parallelFor(map_.size(), kSweepGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t) {
      const float scale = 1.0f / weightOf(t);
      light.flat[t] *= scale;
      for (std::vector<Vec3>& map : light.rnm) map[t] *= scale;
    }
  });
  return light;
}

BakedTexel GatherIntegrator::texel(std::uint32_t page, std::size_t index) const {
  const std::size_t t = map_.firstOfPage(page) + index;
  const float scale = 1.0f / weightOf(t);
  BakedTexel baked;
  baked.coverage = coverage_[t];
  const auto taken = static_cast<float>(std::max(1u, samplesOf_[t]));
  baked.validity = 1.0f - static_cast<float>(backFaces_[t]) / taken;
  baked.standardError = errorOf(firstWave_[page] + index / kLanes, index % kLanes);
  if (coverage_[t] > 0.0f) baked.samples = samplesOf_[t];
  baked.probed = index % kProbeStride == 0;
  if (baked.probed)
    for (std::size_t k = 0; k < kProbeNormals; ++k) baked.probes[k] = probes_[probeOf(page, index)][k] * scale;
  return baked;
}

}  // namespace lumel
