#include "baker/path/path_integrator.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>

#include "baker/light/direct_light.h"
#include "baker/light/near_lights.h"
#include "baker/rays/non_finite.h"
#include "baker/rays/sampling.h"
#include "baker/rays/stratified_net.h"
#include "baker/rays/texel_parts.h"

namespace lumel {
namespace {

/// Paths may end by Russian roulette after this many bounces.
constexpr int kRouletteAfter = 4;

/// The sample patterns of a texel: a block for the first receiver, then one for every hit.
constexpr std::uint32_t kFootprint = kLightPatterns;
constexpr std::uint32_t kDirection = kLightPatterns + 1;
constexpr std::uint32_t kRoulette = kLightPatterns + 2;
constexpr std::uint32_t kPatternsPerReceiver = kLightPatterns + 4;
/// The patterns of near lights follow those of all receivers.
constexpr std::uint32_t kNear = 0x80000000u;

/// Lights are chosen by what a pilot of at most so many samples has seen, and from these samples on again by all
/// before.
constexpr std::uint32_t kMostPilotSamples = 8;
constexpr std::array<std::uint32_t, 2> kStretches = {64, 1024};
/// Names the pilot where a stretch is named by its first sample.
constexpr std::uint32_t kPilot = 1;

bool isStretchStart(std::uint32_t sample) { return std::ranges::find(kStretches, sample) != kStretches.end(); }
std::uint32_t stretchEnd(std::uint32_t sample) {
  const auto next = std::ranges::upper_bound(kStretches, sample);
  return next != kStretches.end() ? *next : std::numeric_limits<std::uint32_t>::max();
}

/// Holds the state of one sample's path in one lane.
struct Path {
  Frame frame;            // of the texel's point
  Vec3 gatherTangent{0};  // direction of the gather ray
  float gatherPdf = 0.0f;
  Vec3 beta{0};      // throughput from the gather ray's start
  Vec3 radiance{0};  // what the gather ray has brought back so far
  Vec3 origin{0};    // of the ray in flight: the surface point, before its offset
  float pdf = 0.0f;  // density of the ray in flight's direction
  int losslessHits = 0;
  SampleValue value;
  bool isCut = false;  // it brought more than kMostSampleLight
  std::array<Vec3, kProbeNormals> probes{};
};

class WaveTracer {
 public:
  WaveTracer(const LightTransport& transport, const Encoding& encoding, const Atlas& atlas, const PathOptions& options)
      : transport_(transport), atTexels_(transport.atTexels()), encoding_(encoding), atlas_(atlas), options_(options) {
    punctual_[0].learnt = LearntChoice(atTexels_.punctual.groups());
    punctual_[1].learnt = LearntChoice(transport.punctual.groups());
  }

  WaveResult run(std::uint32_t pageIndex, const PageTexels& page, std::span<const std::uint32_t> texels,
                 std::span<const std::uint32_t> scrambles);

 private:
  void startTexels(std::uint32_t pageIndex, const PageTexels& page, std::span<const std::uint32_t> texels,
                   std::span<const std::uint32_t> scrambles);
  void runPilot(std::uint32_t samples);
  void startStretch(std::uint32_t first);
  TexelSampler samplerOf(std::size_t lane, std::uint32_t stretch) const;
  void startSample();
  void lightTexels();
  void lightFromNear();
  void followPaths();
  void findHits(int depth);
  bool shadeHit(int lane, int depth);
  void playRoulette(int depth);
  bool scatter(int depth);
  void launch(int lane, const Receiver& receiver, const Vec3& dirWorld, float pdf);
  void addLight(int lane, const Vec3& dirTangent, const Vec3& radianceOverPdf);
  void finishSample();
  SurfacePoint pointOf(std::size_t lane, Vec2 u) const;
  /// Tells whether there are lights to choose among by what they were seen to bring. Else all samples are one stretch.
  bool learns() const { return punctual_[0].learnt.isUseful() || punctual_[1].learnt.isUseful(); }
  PunctualChoice* choiceAt(bool texel) {
    PunctualChoice& choice = punctual_[texel ? 0 : 1];
    return choice.learnt.isUseful() ? &choice : nullptr;
  }
  /// Tells whether what shines by itself does not count for a ray.
  bool leavesOut(int depth) const { return depth == 0 && options_.indirectOnly; }

  const LightTransport& transport_;
  const LightTransport atTexels_;
  const Encoding& encoding_;
  const Atlas& atlas_;
  const PathOptions& options_;

  std::uint32_t page_ = 0;
  std::array<TexelCoord, kLanes> coords_;
  std::array<TexelFootprint, kLanes> footprints_;
  std::array<bool, kLanes> covered_{};
  std::array<std::vector<NearLight>, kLanes> near_;
  alignas(64) std::array<float, kLanes> perReach2_{};
  bool anyNear_ = false;
  std::array<std::vector<std::uint32_t>, kLanes> parts_;  // of divided texels: the numbers of their points
  LightLanes lanes_;                                      // receivers of the light that is sampled next
  std::array<Path, kLanes> paths_;
  std::array<std::uint32_t, kLanes> scrambles_{};  // 0: none
  std::array<TexelSampler, kLanes> samplers_;
  SampleLanes samples_;
  NetLanes net_;
  std::array<PunctualChoice, 2> punctual_;  // at texels, and at hits
  RayPacket rays_;
  std::array<HitSurface, kLanes> hits_;
  WaveResult result_;
};

WaveResult WaveTracer::run(std::uint32_t pageIndex, const PageTexels& page, std::span<const std::uint32_t> texels,
                           std::span<const std::uint32_t> scrambles) {
  startTexels(pageIndex, page, texels, scrambles);
  const auto samples = static_cast<std::uint32_t>(options_.samples);
  if (learns()) runPilot(samples);
  for (std::uint32_t begin = 0; begin < samples;) {
    if (learns() && isStretchStart(begin)) startStretch(begin);
    const NetRange range = netAt(begin, learns() ? std::min(samples, stretchEnd(begin)) : samples);
    net_.fill(samplers_, covered_, range, kDirection);
    for (std::uint32_t step = 0; step < range.count(); ++step) {
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        samples_.setSample(static_cast<int>(lane), net_.sample(step, lane));
      startSample();
      if (!options_.indirectOnly) lightTexels();
      followPaths();
      finishSample();
    }
    begin += range.count();
  }
  return std::move(result_);
}

void WaveTracer::startTexels(std::uint32_t pageIndex, const PageTexels& page, std::span<const std::uint32_t> texels,
                             std::span<const std::uint32_t> scrambles) {
  page_ = pageIndex;
  for (std::size_t lane = 0; lane < texels.size(); ++lane) {
    coords_[lane] = page.coords[texels[lane]];
    const double area = footprints_[lane].clip(atlas_, page, texels[lane]);
    TexelResult& texel = result_.texels[lane];
    texel.coverage = static_cast<float>(std::min(area, 1.0));
    texel.probed = texels[lane] % kProbeStride == 0;
    covered_[lane] = area > 0.0;
    NearLights near = nearLightsOf(atTexels_.punctual, footprints_[lane]);
    near_[lane] = std::move(near.lights);
    perReach2_[lane] = near.perReach2;
    anyNear_ = anyNear_ || near.perReach2 > 0.0f;
    if (!scrambles.empty()) scrambles_[lane] = scrambles[lane];
    samplers_[lane] = samplerOf(lane, 0);
    samples_.setTexel(static_cast<int>(lane), samplers_[lane]);
  }
  const TexelParts parts(transport_.rays, transport_.materials, atlas_, page);
  forEachLane(parts.suspects(texels), [&](std::size_t lane) {
    if (const auto points = parts.pointsOf(texels[lane], samplerOf(lane, 0).seedOf(kFootprint)))
      parts_[lane] = points->numbers();
  });
}

/// A point of the texel; of a divided texel one on the part that counts.
SurfacePoint WaveTracer::pointOf(std::size_t lane, Vec2 u) const {
  if (const std::vector<std::uint32_t>& own = parts_[lane]; !own.empty())
    u = sobol2D(own[samples_.sample(static_cast<int>(lane)) % own.size()], samplerOf(lane, 0).seedOf(kFootprint));
  return footprints_[lane].sample(u);
}

/// The sampler of a texel in the stretch that begins with sample `stretch`.
TexelSampler WaveTracer::samplerOf(std::size_t lane, std::uint32_t stretch) const {
  const TexelSampler sampler(options_.seed + (std::uint64_t{stretch} << 32), page_, coords_[lane].x, coords_[lane].y);
  return scrambles_[lane] == 0 ? sampler : TexelSampler(sampler.seedOf(scrambles_[lane]), 0, 0, 0);
}

/// Takes samples that only teach which lights arrive, and that are not part of the result.
void WaveTracer::runPilot(std::uint32_t samples) {
  startStretch(kPilot);
  for (std::uint32_t i = 0; i < std::clamp(samples / 8, 1u, kMostPilotSamples); ++i) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) samples_.setSample(static_cast<int>(lane), i);
    startSample();
    if (!options_.indirectOnly) lightTexels();
    followPaths();
  }
  for (TexelResult& texel : result_.texels) texel.sums = {};
  result_.cutPaths = 0;
  startStretch(0);
}

/// From sample `first` on lights are chosen by what was seen before, and samples have scrambles of their own: a choice
/// that depended on samples of a sequence would lean, because the sequence evades its own earlier points.
void WaveTracer::startStretch(std::uint32_t first) {
  for (PunctualChoice& choice : punctual_) choice.learnt.learn();
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    samplers_[lane] = samplerOf(lane, first);
    samples_.setTexel(static_cast<int>(lane), samplers_[lane]);
  }
}

void WaveTracer::startSample() {
  rays_.clear();
  const UnitSquareLanes footprint = samples_.draw2D(kFootprint);
  const UnitSquareLanes direction = samples_.draw2D(kDirection);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    lanes_.active[lane] = covered_[lane];
    if (!covered_[lane]) continue;
    const SurfacePoint point = pointOf(lane, footprint[static_cast<int>(lane)]);
    Path& path = paths_[lane];
    path = Path{};
    path.frame = point.frame;
    Receiver& receiver = lanes_.receivers[lane];
    receiver = receiverAt(transport_.rays, atlas_, point);
    path.gatherTangent = sampleGatherHemisphere(direction[static_cast<int>(lane)]);
    path.gatherPdf = gatherHemispherePdf(path.gatherTangent.z);
    const Vec3 dirWorld = path.frame.fromLocal(path.gatherTangent);
    // A bent shading normal gathers from below the surface too, where nothing arrives.
    if (receiver.isOpenTowards(dirWorld)) launch(static_cast<int>(lane), receiver, dirWorld, path.gatherPdf);
    path.beta = Vec3(1.0f);
  }
}

void WaveTracer::launch(int lane, const Receiver& receiver, const Vec3& dirWorld, float pdf) {
  Path& path = paths_[static_cast<std::size_t>(lane)];
  path.origin = receiver.p;
  path.pdf = pdf;
  rays_.set(lane, receiver.startTowards(dirWorld), dirWorld);
  ++result_.rays;
}

void WaveTracer::addLight(int lane, const Vec3& dirTangent, const Vec3& radianceOverPdf) {
  const auto l = static_cast<std::size_t>(lane);
  Path& path = paths_[l];
  const Vec3 arriving = radianceOverPdf * kInvPi;
  const Vec3 light = glm::min(arriving, Vec3(kMostSampleLight));  // what is no number stays so
  path.isCut = path.isCut || light != arriving;
  const MapKernels kernels = encoding_.kernels(dirTangent);
  path.value.flat += light * std::max(0.0f, dirTangent.z);
  for (std::size_t i = 0; i < encoding_.mapCount(); ++i) path.value.maps[i] += light * kernels[i];
  if (result_.texels[l].probed)
    for (std::size_t i = 0; i < kProbeNormals; ++i)
      path.probes[i] += light * std::max(0.0f, glm::dot(dirTangent, probeNormals()[i]));
}

/// Adds the peaks of lights that lie close to a texel, which samples at its points leave out (NearLight).
void WaveTracer::lightFromNear() {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const int l = static_cast<int>(lane);
    const std::uint32_t sample = samples_.sample(l);
    for (std::size_t k = 0; k < near_[lane].size(); ++k) {
      const std::uint32_t pattern = kNear + static_cast<std::uint32_t>(k);
      const NearSample near =
          sampleNear(atTexels_, atlas_, footprints_[lane], near_[lane][k], samplers_[lane].get2D(sample, pattern),
                     samplers_[lane].get2D(sample, pattern + kPunctualPoint));
      if (near.light == Vec3(0.0f)) continue;
      ShadowPacket shadow;
      shadow.clear();
      const Vec3 start = near.receiver.startTowards(near.wi);
      shadow.set(l, start, near.target - start, 1.0f);
      transport_.rays.occluded(shadow, TraceMode::Packet);
      ++result_.shadowRays;
      if (shadow.visible(l)) addLight(l, near.frame.toLocal(near.wi), near.light);
    }
  }
}

void WaveTracer::lightTexels() {
  lanes_.perReach2 = anyNear_ ? perReach2_.data() : nullptr;
  result_.shadowRays += directLight(
      atTexels_, lanes_, samples_, 0, TraceMode::Packet, kGatherDensity,
      [&](int lane, const Vec3& wi, const Vec3& light) {
        addLight(lane, paths_[static_cast<std::size_t>(lane)].frame.toLocal(wi), light);
      },
      choiceAt(true));
  lanes_.perReach2 = nullptr;
  if (anyNear_) lightFromNear();
}

void WaveTracer::followPaths() {
  for (int depth = 0;; ++depth) {
    transport_.rays.intersect(rays_, TraceMode::Packet);
    if (rays_.tinted != 0)
      for (std::size_t lane = 0; lane < kLanes; ++lane) paths_[lane].beta *= rays_.tint(lane);
    findHits(depth);
    for (int lane = 0; lane < kLanes; ++lane)
      lanes_.active[static_cast<std::size_t>(lane)] = rays_.valid[lane] != 0 && shadeHit(lane, depth);
    if (depth >= kRouletteAfter) playRoulette(depth);
    if (std::none_of(lanes_.active.begin(), lanes_.active.end(), [](bool active) { return active; })) break;
    const std::uint32_t pattern = static_cast<std::uint32_t>(depth + 1) * kPatternsPerReceiver;
    result_.shadowRays += directLight(
        transport_, lanes_, samples_, pattern, TraceMode::Packet, kCosineDensity,
        [&](int lane, const Vec3& wi, const Vec3& light) {
          Path& path = paths_[static_cast<std::size_t>(lane)];
          const float cosTheta = glm::dot(wi, lanes_.receivers[static_cast<std::size_t>(lane)].ns);
          path.radiance += path.beta * light * (cosTheta * kInvPi);
        },
        choiceAt(false));
    // The last ray of a path only looks for what shines by itself.
    if (depth + 1 == options_.bounces && !transport_.raysSeeLight()) break;
    if (!scatter(depth)) break;
  }
}

/// Looks up the surfaces that the lanes' rays hit before any is shaded, so that the lanes wait for memory together.
void WaveTracer::findHits(int depth) {
  for (int lane = 0; lane < kLanes; ++lane)
    if (rays_.hit(lane)) hits_[static_cast<std::size_t>(lane)] = transport_.rays.surfaceAt(rays_, lane);
  if (depth == options_.bounces) return;
  for (int lane = 0; lane < kLanes; ++lane)
    if (rays_.hit(lane)) transport_.materials.findAlbedo(hits_[static_cast<std::size_t>(lane)].point).prefetch();
}

/// Adds what shines by itself where the ray in flight ended. Returns whether the path goes on from there; then
/// lanes_.receivers holds the point and beta has been multiplied by its albedo.
bool WaveTracer::shadeHit(int lane, int depth) {
  const auto l = static_cast<std::size_t>(lane);
  Path& path = paths_[l];
  if (!rays_.hit(lane)) {
    if (depth == 0) result_.texels[l].sums.countGatherRay(false);
    if (!transport_.environment.shines() || leavesOut(depth)) return false;
    path.radiance += path.beta * transport_.environment.arriving(rays_.direction(lane), path.pdf);
    return false;
  }
  const HitSurface& hit = hits_[l];
  if (depth == 0)
    result_.texels[l].sums.countGatherRay(hit.backFace && !transport_.materials.material(hit.material).doubleSided);
  const Vec3 emitted = emittedTowardsRay(transport_.materials, hit);
  if (emitted != Vec3(0.0f) && !leavesOut(depth))
    path.radiance += path.beta * emitted * misWeight(path.pdf, transport_.emitterPdf(hit, path.origin));
  if (depth == options_.bounces) return false;
  path.beta *= transport_.materials.albedo(hit.point);
  if (path.beta == Vec3(0.0f)) return false;
  lanes_.receivers[l] = {hit.p, hit.ng, transport_.rays.shadingNormal(hit), transport_.rays.rayStart(hit)};
  return true;
}

/// Ends paths by Russian roulette, with the throughput as the chance to go on: a path that goes on stands for those
/// that ended. The throughput is 1 afterwards, so from then on a hit of albedo rho ends a share 1 - rho. (Ending more
/// would make the variance of a sum over k hits grow as rho^2k / survival^k.)
void WaveTracer::playRoulette(int depth) {
  const UnitLanes roulette = samples_.draw1D(static_cast<std::uint32_t>(depth + 1) * kPatternsPerReceiver + kRoulette);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (!lanes_.active[lane]) continue;
    Path& path = paths_[lane];
    Vec3& beta = path.beta;
    const float survival = std::clamp(std::max({beta.x, beta.y, beta.z}), 0.05f, 1.0f);
    lanes_.active[lane] = roulette.u[lane] < survival;
    beta /= survival;
    if (survival < 1.0f || options_.bounces >= 0 || ++path.losslessHits < kMostLosslessHits) continue;
    lanes_.active[lane] = 0;
    ++result_.cutPaths;
  }
}

/// Sends the active lanes' paths on by the cosine; returns whether any ray is in flight.
bool WaveTracer::scatter(int depth) {
  rays_.clear();
  const UnitSquareLanes direction =
      samples_.draw2D(static_cast<std::uint32_t>(depth + 1) * kPatternsPerReceiver + kDirection);
  bool any = false;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!lanes_.active[static_cast<std::size_t>(lane)]) continue;
    const Receiver& receiver = lanes_.receivers[static_cast<std::size_t>(lane)];
    const Vec3 local = sampleCosineHemisphere(direction[lane]);
    const Vec3 dirWorld = frameAround(receiver.ns).fromLocal(local);
    if (!(glm::dot(dirWorld, receiver.ng) > 0.0f)) continue;
    launch(lane, receiver, dirWorld, cosineHemispherePdf(local.z));
    any = true;
  }
  return any;
}

bool allFinite(const SampleValue& value, std::size_t maps) {
  return isFinite(value.flat) && std::all_of(value.maps.begin(), value.maps.begin() + static_cast<std::ptrdiff_t>(maps),
                                             [](const Vec3& map) { return isFinite(map); });
}

void WaveTracer::finishSample() {
  const std::size_t maps = encoding_.mapCount();
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (!covered_[lane]) continue;
    Path& path = paths_[lane];
    if (path.radiance != Vec3(0.0f))
      addLight(static_cast<int>(lane), path.gatherTangent, path.radiance / path.gatherPdf);
    const std::uint32_t sample = samples_.sample(static_cast<int>(lane));
    const bool isNumber = allFinite(path.value, maps);
    if (!isNumber || path.isCut) result_.nonFinite.push_back({page_, coords_[lane], sample});
    if (!isNumber) continue;
    TexelResult& texel = result_.texels[lane];
    texel.sums.add(
        path.value, maps,
        static_cast<int>(std::uint64_t{sample} * TexelSums::kBatches / static_cast<std::uint64_t>(options_.samples)));
    if (texel.probed)
      for (std::size_t i = 0; i < kProbeNormals; ++i) texel.probes[i] += path.probes[i];
  }
}

}  // namespace

PathIntegrator::PathIntegrator(const LightTransport& transport, const Encoding& encoding, const Atlas& atlas,
                               const PathOptions& options)
    : transport_(transport), encoding_(encoding), atlas_(atlas), options_(options) {}

WaveResult PathIntegrator::bakeWave(std::uint32_t pageIndex, const PageTexels& page, std::size_t first,
                                    std::size_t count) const {
  std::array<std::uint32_t, kLanes> texels;
  std::iota(texels.begin(), texels.end(), static_cast<std::uint32_t>(first));
  return traceTexels(pageIndex, page, std::span(texels).first(count), {});
}

WaveResult PathIntegrator::traceTexels(std::uint32_t pageIndex, const PageTexels& page,
                                       std::span<const std::uint32_t> texels,
                                       std::span<const std::uint32_t> scrambles) const {
  WaveTracer tracer(transport_, encoding_, atlas_, options_);
  return tracer.run(pageIndex, page, texels, scrambles);
}

}  // namespace lumel
