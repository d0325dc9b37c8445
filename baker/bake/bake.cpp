#include "baker/bake/bake.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "baker/bake/gather_session.h"
#include "baker/gather/doubling_error.h"
#include "baker/gather/gather_integrator.h"
#include "baker/gather/waves/waves.h"
#include "baker/light/lit_scene.h"
#include "baker/path/path_integrator.h"
#include "baker/path/texel_sums.h"
#include "baker/rays/flush_denormals.h"
#include "baker/rays/texel_parts.h"
#include "scene/base/check.h"
#include "scene/base/parallel.h"
#include "scene/base/stopwatch.h"

namespace lumel {
namespace {

constexpr std::size_t kMostNotes = 10;

/// Samples per texel where nothing shines: only validity is left to find out.
constexpr int kSamplesInTheDark = 8;

/// What a wave leaves beside its texels' pixels; summed in the order of waves.
struct WaveStats {
  std::uint64_t rays = 0;
  std::uint64_t shadowRays = 0;
  std::uint64_t cutPaths = 0;
  std::size_t nonFinite = 0;
  std::vector<NonFiniteSample> firstNonFinite;
  double luminance = 0.0;
  std::size_t validTexels = 0;
  double residualSquares = 0.0;
  std::size_t residuals = 0;
};

/// Enters a texel's aux pixel and figures.
void storeAux(Image& aux, TexelCoord at, const BakedTexel& texel, const Encoding& encoding, const SampleValue& stored,
              WaveStats& stats) {
  float* pixel = aux.at(at.x, at.y);
  pixel[0] = texel.coverage;
  pixel[1] = texel.validity;
  pixel[2] = texel.standardError;
  pixel[3] = static_cast<float>(texel.samples);
  if (texel.validity < kLeastValidity) return;
  ++stats.validTexels;
  stats.luminance += static_cast<double>(luminance(stored.flat));
  if (!texel.probed) return;
  const StoredEncoding first = encoding.stored().front();
  for (std::size_t i = 0; i < kProbeNormals; ++i) {
    const auto difference = static_cast<double>(
        luminance(decodeSampled(first, stored.maps, stored.flat, probeNormals()[i])) - luminance(texel.probes[i]));
    stats.residualSquares += difference * difference;
    ++stats.residuals;
  }
}

/// Stores the result of a path-traced texel.
void storeTexel(BakedPage& page, TexelCoord at, const TexelResult& texel, const Encoding& encoding, WaveStats& stats) {
  if (!(texel.coverage > 0.0f)) return;
  BakedTexel baked{.coverage = texel.coverage,
                   .validity = texel.sums.validity(),
                   .samples = texel.sums.count(),
                   .probed = texel.probed && texel.sums.count() > 0};
  if (baked.probed)
    for (std::size_t i = 0; i < kProbeNormals; ++i)
      baked.probes[i] = Vec3(texel.probes[i] / static_cast<double>(baked.samples));
  SampleValue value = texel.sums.mean();
  encoding.finish(std::span(value.maps).first(encoding.mapCount()), value.flat);
  for (std::size_t i = 0; i < page.maps.size(); ++i) page.maps[i].setRgb(at.x, at.y, value.maps[i]);
  page.flat.setRgb(at.x, at.y, value.flat);
  storeAux(page.aux, at, baked, encoding, value, stats);
}

BakeStats sumUp(std::span<const WaveStats> waves, const BakeOptions& options) {
  BakeStats total;
  double luminanceSum = 0.0;
  double residualSquares = 0.0;
  std::size_t valid = 0;
  std::size_t residuals = 0;
  std::vector<std::string> notes;
  for (const WaveStats& wave : waves) {
    total.rays += wave.rays;
    total.shadowRays += wave.shadowRays;
    total.cutPaths += wave.cutPaths;
    total.nonFiniteSamples += wave.nonFinite;
    luminanceSum += wave.luminance;
    valid += wave.validTexels;
    residualSquares += wave.residualSquares;
    residuals += wave.residuals;
    for (const NonFiniteSample& s : wave.firstNonFinite)
      if (notes.size() < kMostNotes)
        notes.push_back("sample that is not finite (infinite light is cut, what is no number is left out): page " +
                        std::to_string(s.page) + ", texel (" + std::to_string(s.texel.x) + ", " +
                        std::to_string(s.texel.y) + "), sample " + std::to_string(s.sample) + ", seed " +
                        std::to_string(options.seed));
  }
  if (total.cutPaths > 0)
    notes.push_back("light of more than " + std::to_string(kMostLosslessHits) +
                    " bounces is missing: surfaces of albedo 1 kept " + std::to_string(total.cutPaths) +
                    " paths without end; give them a lower albedo, or say how many --bounces count");
  total.notes = std::move(notes);
  if (valid > 0) total.meanFlat = luminanceSum / static_cast<double>(valid);
  if (residuals > 0 && total.meanFlat > 0)
    total.projectionResidual = std::sqrt(residualSquares / static_cast<double>(residuals)) / total.meanFlat;
  return total;
}

Image pageImage(const Atlas& atlas, std::size_t page, int channels) {
  return Image(atlas.pages[page].width, atlas.pages[page].height, channels);
}

constexpr std::size_t kTexelGrain = 1024;

/// Finishes the light of a page's texels [first, last) and stores all but the maps.
void finishTexels(const GatherIntegrator& integrator, const GatherState& state, std::uint32_t page,
                  const PageTexels& texels, std::size_t first, std::size_t last, const Encoding& encoding,
                  TexelLight& light, std::span<const float> mapErrors, BakedPage& baked, WaveStats& stats) {
  for (std::size_t i = first; i < last; ++i) {
    const BakedTexel texel = integrator.texel(state, page, i);
    if (!(texel.coverage > 0.0f)) continue;
    const std::size_t t = integrator.numberOf(page, i);
    SampleValue value{.flat = light.flat[t]};
    for (std::size_t k = 0; k < encoding.mapCount(); ++k) value.maps[k] = light.maps[k][t];
    encoding.finish(std::span(value.maps).first(encoding.mapCount()), value.flat);
    float* errors = baked.mapErrors.at(texels.coords[i].x, texels.coords[i].y);
    for (std::size_t k = 0; k < encoding.mapCount(); ++k) {
      light.maps[k][t] = value.maps[k];
      errors[k] = mapErrors[t * encoding.mapCount() + k];
    }
    storeAux(baked.aux, texels.coords[i], texel, encoding, value, stats);
  }
}

/// The pages' images of one map; its texels are freed.
std::vector<Image> takeMap(std::vector<Vec3>& map, const Atlas& atlas, const std::vector<PageTexels>& texels) {
  std::vector<Image> images;
  std::size_t before = 0;
  for (std::size_t p = 0; p < texels.size(); ++p) {
    Image& image = images.emplace_back(pageImage(atlas, p, 3));
    const std::vector<TexelCoord>& coords = texels[p].coords;
    parallelFor(coords.size(), kTexelGrain, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) image.setRgb(coords[i].x, coords[i].y, map[before + i]);
    });
    before += coords.size();
  }
  map = std::vector<Vec3>();
  return images;
}

GatherOptions gatherOptionsOf(const BakeOptions& options) {
  return {.samples = std::max(1, options.samples),
          .maxSamples = options.maxSamples,
          .bounces = options.bounces,
          .indirectOnly = options.indirectOnly,
          .seed = options.seed,
          .targetError = options.targetError,
          .adaptive = options.adaptive,
          .timeBudgetSeconds = static_cast<double>(options.timeBudgetSeconds)};
}

WaveStats countsOf(const GatherState& state) {
  WaveStats stats;
  stats.rays = state.rays;
  stats.shadowRays = state.shadowRays;
  stats.nonFinite = state.nonFinite.size();
  const auto named = static_cast<std::ptrdiff_t>(std::min(kMostNotes, stats.nonFinite));
  for (auto it = state.nonFinite.begin(); it < state.nonFinite.begin() + named; ++it)
    stats.firstNonFinite.push_back(it->sample);
  return stats;
}

Expected<std::vector<WaveStats>> gather(const LightTransport& transport, const Atlas& atlas,
                                        const std::vector<PageTexels>& texels, const BakeOptions& options,
                                        GatherSession& session, std::vector<BakedPage>& pages, Progress& progress) {
  const Encoding& encoding = *options.encoding;
  std::optional<GatherIntegrator> integrator(std::in_place, transport, encoding, atlas, texels,
                                             gatherOptionsOf(options));
  if (!session.state) session.state = integrator->begin();
  GatherState& state = *session.state;
  if (auto done = integrator->run(state, progress, session.pauses); !done) return done.error();
  if (session.keepsSurfaces) session.surfaces.emplace(integrator->takeSurfaces(state));
  state.dropCache();
  // Texels become pages map by map: the two together would be the peak of a bake's memory.
  TexelLight light = integrator->takeLight(state);
  std::vector<float> mapErrors = integrator->takeMapErrors(state);
  pages.resize(atlas.pages.size());
  std::vector<WaveStats> stats(1, countsOf(state));
  for (std::size_t p = 0; p < pages.size(); ++p) {
    pages[p].aux = pageImage(atlas, p, 4);
    pages[p].mapErrors = pageImage(atlas, p, static_cast<int>(encoding.mapCount()));
    const std::size_t before = stats.size();
    stats.resize(before + (texels[p].size() + kTexelGrain - 1) / kTexelGrain);
    parallelFor(texels[p].size(), kTexelGrain, [&](std::size_t first, std::size_t last) {
      finishTexels(*integrator, state, static_cast<std::uint32_t>(p), texels[p], first, last, encoding, light,
                   mapErrors, pages[p], stats[before + first / kTexelGrain]);
    });
  }
  session.state.reset();
  integrator.reset();
  mapErrors = std::vector<float>();
  const auto take = [&](std::vector<Vec3>& map, auto imageOf) {
    std::vector<Image> images = takeMap(map, atlas, texels);
    for (std::size_t p = 0; p < pages.size(); ++p) imageOf(pages[p]) = std::move(images[p]);
  };
  for (BakedPage& page : pages) page.maps.resize(encoding.mapCount());
  for (std::size_t k = 0; k < encoding.mapCount(); ++k)
    take(light.maps[k], [k](BakedPage& page) -> Image& { return page.maps[k]; });
  take(light.flat, [](BakedPage& page) -> Image& { return page.flat; });
  return stats;
}

/// Long paths gain little from their sequence, and tails are heavy: no credit is taken.
constexpr double kPathCredit = 0.0;
/// Batches after which the mean of a path-traced texel is kept: each has twice the samples of the one before.
constexpr std::array<int, 5> kMarks = {1, 2, 4, 8, TexelSums::kBatches};
/// Luminances of the flat map and of the encoding's as they would be stored.
struct StoredMeans {
  std::array<float, kLanes> flat{};
  DoublingError::MapMeans maps{};
};
using WaveMeans = std::array<StoredMeans, kMarks.size()>;

/// As if light had one colour: of the maps' colours only the luminance is known.
void keepMeans(const TexelSums& sums, int mark, const Encoding& encoding, std::size_t lane, StoredMeans& means) {
  const std::array<float, 1 + kMostMaps> luminances = sums.luminancesBefore(mark);
  std::array<Vec3, kMostMaps> maps{};
  for (std::size_t k = 0; k < encoding.mapCount(); ++k) maps[k] = Vec3(luminances[k + 1]);
  encoding.finish(std::span(maps).first(encoding.mapCount()), Vec3(luminances[0]));
  means.flat[lane] = luminances[0];
  for (std::size_t k = 0; k < encoding.mapCount(); ++k) means.maps[k][lane] = maps[k].x;
}

/// The standard errors of path-traced texels, as if their samples had been taken by doubling.
void storePathErrors(const Waves& waves, const std::vector<WaveMeans>& means, int samples,
                     const std::vector<PageTexels>& texels, std::size_t maps, std::vector<BakedPage>& pages) {
  DoublingError errors(waves, kPathCredit);
  errors.mapSums.resize(waves.texels() * maps);
  const std::vector<std::uint8_t> live(waves.size(), 1);
  for (std::size_t m = 0; m < kMarks.size(); ++m) {
    const auto samplesAt = [samples](int mark) {
      return static_cast<std::uint32_t>((std::int64_t{samples} * mark + TexelSums::kBatches - 1) / TexelSums::kBatches);
    };
    const std::uint32_t before = m == 0 ? 0 : samplesAt(kMarks[m - 1]);
    const std::uint32_t now = samplesAt(kMarks[m]);
    if (now == before) continue;
    for (std::size_t w = 0; w < waves.size(); ++w) {
      const StoredMeans& first = means[w][m == 0 ? 0 : m - 1];
      errors.add(waves, w, first.flat, means[w][m].flat, before, now - before);
      errors.addMaps(waves, w, first.maps, means[w][m].maps, before, now - before);
    }
    errors.endPass(waves, live);
  }
  const std::vector<float> mapErrors = errors.takeMapErrors(waves, maps);
  for (std::size_t w = 0; w < waves.size(); ++w)
    for (std::size_t i = 0; i < waves[w].count; ++i) {
      const TexelCoord at = texels[waves[w].page].coords[waves[w].first + i];
      BakedPage& page = pages[waves[w].page];
      float* aux = page.aux.at(at.x, at.y);
      if (!(aux[0] > 0.0f)) continue;
      aux[2] = errors.standardError(waves, w, i);
      std::copy_n(mapErrors.begin() + static_cast<std::ptrdiff_t>((waves[w].start + i) * maps), maps,
                  page.mapErrors.at(at.x, at.y));
    }
}

/// Path-traced texels that see the backs of covers from the open are valid.
void judgeCovers(const LightTransport& transport, const Atlas& atlas, const std::vector<PageTexels>& texels,
                 std::vector<BakedPage>& pages, WaveStats& stats) {
  // 2.8 standard deviations of a fair coin tell what lies in the open.
  constexpr float kCertain = 8.0f;
  for (std::size_t p = 0; p < pages.size(); ++p) {
    std::vector<std::uint8_t> asked(texels[p].size()), seen(texels[p].size()), open(texels[p].size());
    for (std::size_t i = 0; i < texels[p].size(); ++i) {
      const float* aux = pages[p].aux.at(texels[p].coords[i].x, texels[p].coords[i].y);
      const float lead = 2.0f * aux[1] - 1.0f;
      asked[i] = aux[0] > 0.0f && lead < 0.0f ? 1 : 0;
      seen[i] = aux[0] > 0.0f && lead > 0.0f && lead * lead * aux[3] >= kCertain ? 1 : 0;
    }
    if (std::ranges::count(asked, 1) == 0) continue;
    TexelParts(transport.rays, transport.materials, atlas, texels[p]).findOpen(asked, seen, open);
    for (std::size_t i = 0; i < texels[p].size(); ++i) {
      if (asked[i] == 0 || open[i] == 0) continue;
      const TexelCoord at = texels[p].coords[i];
      pages[p].aux.at(at.x, at.y)[1] = 1.0f;
      ++stats.validTexels;
      stats.luminance += static_cast<double>(luminance(pages[p].flat.rgb(at.x, at.y)));
    }
  }
}

Expected<std::vector<WaveStats>> tracePaths(const LightTransport& transport, const Atlas& atlas,
                                            const std::vector<PageTexels>& texels, const BakeOptions& options,
                                            std::vector<BakedPage>& pages, Progress& progress) {
  const Encoding& encoding = *options.encoding;
  const PathIntegrator integrator(transport, encoding, atlas,
                                  {.samples = std::max(1, options.samples),
                                   .bounces = options.bounces,
                                   .indirectOnly = options.indirectOnly,
                                   .seed = options.seed});
  pages.resize(atlas.pages.size());
  for (std::size_t p = 0; p < pages.size(); ++p) {
    pages[p].flat = pageImage(atlas, p, 3);
    pages[p].maps.assign(encoding.mapCount(), pages[p].flat);
    pages[p].aux = pageImage(atlas, p, 4);
    pages[p].mapErrors = pageImage(atlas, p, static_cast<int>(encoding.mapCount()));
  }
  const Waves waves(texels);
  std::vector<WaveStats> waveStats(waves.size());
  std::vector<WaveMeans> means(waves.size());
  progress.begin("bake", waves.texels());
  parallelFor(waves.size(), 1, [&](std::size_t first, std::size_t last) {
    const FlushDenormals flush;
    for (std::size_t w = first; w < last; ++w) {
      if (progress.cancelled()) return;
      const Wave& wave = waves[w];
      const PageTexels& page = texels[wave.page];
      WaveResult done = integrator.bakeWave(wave.page, page, wave.first, wave.count);
      WaveStats& stats = waveStats[w];
      stats.rays = done.rays;
      stats.shadowRays = done.shadowRays;
      stats.cutPaths = done.cutPaths;
      stats.nonFinite = done.nonFinite.size();
      done.nonFinite.resize(std::min(done.nonFinite.size(), kMostNotes));
      stats.firstNonFinite = std::move(done.nonFinite);
      for (std::size_t m = 0; m < kMarks.size(); ++m)
        for (std::size_t i = 0; i < wave.count; ++i)
          keepMeans(done.texels[i].sums, kMarks[m], encoding, i, means[w][m]);
      for (std::size_t i = 0; i < wave.count; ++i)
        storeTexel(pages[wave.page], page.coords[wave.first + i], done.texels[i], encoding, stats);
      progress.advance(wave.count);
    }
  });
  progress.end();
  if (progress.cancelled()) return interrupted();
  judgeCovers(transport, atlas, texels, pages, waveStats.emplace_back());
  storePathErrors(waves, means, std::max(1, options.samples), texels, encoding.mapCount(), pages);
  return waveStats;
}

/// Options as they can be followed: where nothing shines only validity is left to find out.
BakeOptions optionsFor(const LightTransport& transport, BakeOptions options) {
  if (!transport.dark()) return options;
  options.samples = std::min(options.samples, kSamplesInTheDark);
  options.bounces = 0;
  options.targetError = 0.0f;
  return options;
}

/// Traces the ways across seams, 16 at a time.
void traceCrossings(const RayScene& rays, std::span<const SeamCrossing> crossings, std::span<std::uint8_t> blocked) {
  constexpr std::size_t kGrain = 64 * kLanes;
  parallelFor(crossings.size(), kGrain, [&](std::size_t first, std::size_t last) {
    ShadowPacket packet;
    for (std::size_t begin = first; begin < last; begin += kLanes) {
      const std::size_t count = std::min<std::size_t>(kLanes, last - begin);
      packet.clear();
      for (std::size_t i = 0; i < count; ++i) {
        const SeamCrossing& crossing = crossings[begin + i];
        packet.set(static_cast<int>(i), crossing.from, crossing.to - crossing.from, 1.0f);
      }
      rays.occluded(packet, TraceMode::Packet);
      for (std::size_t i = 0; i < count; ++i) blocked[begin + i] = packet.visible(static_cast<int>(i)) ? 0 : 1;
    }
  });
}

}  // namespace

Expected<BakeResult> bake(const Scene& scene, const Atlas& atlas, const std::vector<PageTexels>& texels,
                          const BakeOptions& options, Progress& progress) {
  const Stopwatch sinceStart;
  const auto lit = LitScene::build(scene, options.bounces != 0);
  if (!lit) return lit.error();
  auto result = bake(**lit, atlas, texels, options, progress);
  if (result) result->stats.seconds = sinceStart.seconds();
  return result;
}

Expected<BakeResult> bake(const LitScene& scene, const Atlas& atlas, const std::vector<PageTexels>& texels,
                          const BakeOptions& askedFor, Progress& progress, GatherSession* session) {
  LUMEL_CHECK(scene.hasAlbedo() || askedFor.bounces == 0);
  const Stopwatch sinceStart;
  const LightTransport& transport = scene.transport();
  const BakeOptions options = optionsFor(transport, askedFor);
  BakeResult result;
  GatherSession alone;
  const auto waveStats =
      options.integrator == Integrator::Gather
          ? gather(transport, atlas, texels, options, session != nullptr ? *session : alone, result.pages, progress)
          : tracePaths(transport, atlas, texels, options, result.pages, progress);
  if (!waveStats) return waveStats.error();

  if (options.seams)
    result.seams = findSeams(atlas, [&](std::span<const SeamCrossing> crossings, std::span<std::uint8_t> blocked) {
      traceCrossings(transport.rays, crossings, blocked);
    });
  result.stats = sumUp(*waveStats, options);
  if (transport.dark())  // known without samples
    for (BakedPage& page : result.pages) {
      for (std::size_t i = 2; i < page.aux.pixels.size(); i += 4) page.aux.pixels[i] = 0.0f;
      std::fill(page.mapErrors.pixels.begin(), page.mapErrors.pixels.end(), 0.0f);
    }
  result.stats.errors = statedErrors(result.pages, *options.encoding);
  for (const PageTexels& page : texels) result.stats.texels += page.size();
  result.stats.notes.insert(result.stats.notes.begin(), scene.notes().begin(), scene.notes().end());
  result.stats.seconds = sinceStart.seconds();
  return result;
}

std::vector<MapErrorFigure> statedErrors(std::span<const BakedPage> pages, const Encoding& encoding) {
  std::vector<MapErrorFigure> figures{{"flat"}};
  for (const std::string& name : encoding.mapNames()) figures.push_back({name});
  std::vector<std::size_t> known(figures.size(), 0);
  for (const BakedPage& page : pages)
    for (std::size_t i = 0; i < page.aux.pixels.size() / 4; ++i) {
      const float* aux = page.aux.pixels.data() + 4 * i;
      if (!(aux[0] > 0.0f) || aux[1] < kLeastValidity) continue;
      for (std::size_t m = 0; m < figures.size(); ++m) {
        const float error = m == 0 ? aux[2] : page.mapErrors.pixels[i * encoding.mapCount() + m - 1];
        if (!std::isfinite(error)) continue;
        figures[m].mean += static_cast<double>(error);
        ++known[m];
      }
    }
  for (std::size_t m = 0; m < figures.size(); ++m) {
    if (known[m] == 0) return {};
    figures[m].mean /= static_cast<double>(known[m]);
  }
  return figures;
}

std::uint64_t sessionKey(const LitScene& scene, const Atlas& atlas, const std::vector<PageTexels>& texels,
                         const BakeOptions& askedFor) {
  const BakeOptions options = optionsFor(scene.transport(), askedFor);
  return GatherIntegrator(scene.transport(), *options.encoding, atlas, texels, gatherOptionsOf(options)).key();
}

void auditBake(const LitScene& scene, const Atlas& atlas, const std::vector<PageTexels>& texels,
               const BakeOptions& options, std::span<const std::string> objectNames, BakeResult& result) {
  std::vector<const Image*> flat, aux;
  for (const BakedPage& page : result.pages) {
    flat.push_back(&page.flat);
    aux.push_back(&page.aux);
  }
  const double rays = static_cast<double>(result.stats.rays + result.stats.shadowRays);
  result.audit = audit(scene.transport(), atlas, texels, flat, aux, objectNames,
                       {.rays = std::max(kAuditRays, static_cast<std::uint64_t>(kAuditShare * rays)),
                        .bounces = options.bounces,
                        .indirectOnly = options.indirectOnly,
                        .seed = options.seed});
}

}  // namespace lumel
