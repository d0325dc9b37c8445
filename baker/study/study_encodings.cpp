#include "baker/study/study_encodings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>

#include "baker/bake/bake.h"
#include "baker/bake/finish.h"
#include "baker/files/names/version.h"
#include "baker/light/lit_scene.h"
#include "baker/study/study_maps.h"
#include "baker/study/study_setup.h"
#include "lightmap/maps/rnm_to_sh.h"
#include "lightmap/texels/texels.h"
#include "scene/files/file_set.h"

namespace lumel {
namespace {

using Json = nlohmann::ordered_json;

/// Normals are looked at so many at a time: a bake sums up irradiance for as many as it has maps.
constexpr std::size_t kNormalsAtOnce = kMostMaps;
constexpr std::size_t kNormals30 = kNormalsAtOnce;
constexpr std::size_t kNormals60 = 3 * kNormalsAtOnce;

/// Directions within an angle of the normal, each for the same solid angle, on a spiral of golden turns.
std::vector<Vec3> normalsWithin(double degrees, std::size_t count) {
  const double lowest = std::cos(degrees * std::numbers::pi / 180.0);
  std::vector<Vec3> normals;
  for (std::size_t i = 0; i < count; ++i) {
    const double place = static_cast<double>(i) + 0.5;
    const double z = 1.0 - (1.0 - lowest) * place / static_cast<double>(count);
    const double azimuth = std::numbers::pi * (1.0 + std::sqrt(5.0)) * place, r = std::sqrt(1.0 - z * z);
    normals.emplace_back(Vec3d(r * std::cos(azimuth), r * std::sin(azimuth), z));
  }
  return normals;
}

/// The truth as an encoding: a map for each of a few normals, which holds irradiance / pi on it.
class IrradianceOnNormals : public Encoding {
 public:
  explicit IrradianceOnNormals(std::span<const Vec3> normals)
      : Encoding({.name = "irradiance",
                  .mapNames = namesOf(normals.size()),
                  .conventions = {{"basis", "normals in tangent space"},
                                  {"order", "map i belongs to normal i"},
                                  {"decode", "irradiance"},
                                  {"decodeFormula", "L = map of the normal"}}}),
        normals_(normals.begin(), normals.end()) {}

  MapKernels kernels(const Vec3& dirTangent) const override {
    MapKernels k{};
    if (dirTangent.z > 0.0f)
      for (std::size_t i = 0; i < normals_.size(); ++i) k[i] = std::max(0.0f, glm::dot(dirTangent, normals_[i]));
    return k;
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& normalTangent) const override {
    const auto nearest =
        std::ranges::max_element(normals_, {}, [&](const Vec3& normal) { return glm::dot(normal, normalTangent); });
    return maps[static_cast<std::size_t>(nearest - normals_.begin())];
  }

 private:
  static std::vector<std::string> namesOf(std::size_t count) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < count; ++i) names.push_back("irradiance" + std::to_string(i));
    return names;
  }

  std::vector<Vec3> normals_;
};

/// sh1 as lumel convert makes it.
class ConvertedSh1 : public Encoding {
 public:
  ConvertedSh1()
      : Encoding({.name = "sh1 converted",
                  .mapNames = sh1Encoding()->mapNames(),
                  .isSigned = true,
                  .conventions = sh1Encoding()->conventions(),
                  .source = rnmEncoding(Projection::Raw)}),
        sh1_(sh1Encoding()) {}

  MapKernels kernels(const Vec3& dirTangent) const override { return source()->kernels(dirTangent); }
  void derive(std::span<const Vec3> rnm, const Vec3& flat, std::span<Vec3> maps) const override {
    std::ranges::copy(sh1FromRawRnm({rnm[0], rnm[1], rnm[2]}, flat), maps.begin());
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& normalTangent) const override {
    return sh1_->decode(maps, normalTangent);
  }

 private:
  std::shared_ptr<const Encoding> sh1_;
};

/// Sums over texels, normals and colours.
struct Sums {
  double square = 0.0;
  double truthSquare = 0.0;
  double negative = 0.0;
  double truth = 0.0;

  double relativeError() const { return truthSquare > 0.0 ? std::sqrt(square / truthSquare) : 0.0; }
};

class Studying {
 public:
  Studying(const Scene& scene, const EncodingStudyOptions& options, Progress& progress)
      : scene_(scene), options_(options), progress_(progress) {}

  Expected<EncodingStudy> run();

 private:
  struct Truth {
    std::vector<Vec3> normals;
    StudyMaps maps;
  };

  /// What bakes keep of a texel, in the encoding's own maps; not denoised, so that all are of the same light.
  Expected<BakeResult> bakeIn(const std::shared_ptr<const Encoding>& encoding) {
    return bake(*lit_, atlas_, texels_,
                {.samples = options_.samples,
                 .adaptive = false,
                 .bounces = options_.bounces,
                 .seed = options_.seed,
                 .encoding = encoding},
                progress_);
  }
  Expected<void> makeTruth(double degrees, std::size_t count, std::vector<Truth>& truths);
  Expected<void> measure(const std::shared_ptr<const Encoding>& encoding, const std::string& name);
  Sums compare(const Encoding& encoding, const StudyMaps& stored, const std::vector<Truth>& truths) const;

  const Scene& scene_;
  EncodingStudyOptions options_;
  Progress& progress_;
  std::unique_ptr<LitScene> lit_;
  Atlas atlas_;
  std::vector<PageTexels> texels_;
  StudyMask mask_;
  std::vector<Truth> within30_, within60_;
  EncodingStudy study_;
};

Expected<void> Studying::makeTruth(double degrees, std::size_t count, std::vector<Truth>& truths) {
  const std::vector<Vec3> normals = normalsWithin(degrees, count);
  for (std::size_t first = 0; first < count; first += kNormalsAtOnce) {
    const auto own = std::span(normals).subspan(first, std::min(kNormalsAtOnce, count - first));
    const auto baked = bakeIn(std::make_shared<IrradianceOnNormals>(own));
    if (!baked) return baked.error();
    if (mask_.empty()) mask_ = validTexels(baked->pages);
    truths.push_back({{own.begin(), own.end()}, mapsOf(baked->pages, mask_)});
  }
  return {};
}

Sums Studying::compare(const Encoding& encoding, const StudyMaps& stored, const std::vector<Truth>& truths) const {
  Sums sums;
  std::array<Vec3, kMostMaps> values{}, negated{};
  const std::size_t count = stored.maps.size();
  for (const Truth& truth : truths)
    for (std::size_t texel = 0; texel < stored.flat.size(); ++texel) {
      for (std::size_t k = 0; k < count; ++k) {
        values[k] = stored.maps[k][texel];
        negated[k] = -values[k];
      }
      for (std::size_t i = 0; i < truth.normals.size(); ++i) {
        const Vec3d seen(encoding.decode(std::span(values).first(count), truth.normals[i]));
        // Signed encodings are odd in their maps and cut at zero: of negated maps what was cut is left.
        Vec3d cut(0.0);
        if (encoding.isSigned()) cut = Vec3d(encoding.decode(std::span(negated).first(count), truth.normals[i]));
        const Vec3d right(truth.maps.maps[i][texel]);
        sums.square += glm::dot(seen - right, seen - right);
        sums.truthSquare += glm::dot(right, right);
        sums.negative += cut.x + cut.y + cut.z;
        sums.truth += right.x + right.y + right.z;
      }
    }
  return sums;
}

Expected<void> Studying::measure(const std::shared_ptr<const Encoding>& encoding, const std::string& name) {
  auto sampled = jointEncoding({encoding});
  if (!sampled) return sampled.error();
  const double cpu = cpuSecondsNow();
  auto baked = bakeIn(*sampled);
  if (!baked) return baked.error();
  encodePages(baked->pages, **sampled);
  const double seconds = cpuSecondsNow() - cpu;
  // Readers take the flat map from its own file.
  for (BakedPage& page : baked->pages) {
    std::vector<Image> own;
    for (const std::string& map : encoding->mapNames()) {
      if (map == kFlatMap)
        own.push_back(page.flat);
      else {
        own.push_back(std::move(page.maps.front()));
        page.maps.erase(page.maps.begin());
      }
    }
    page.maps = std::move(own);
    page.mapErrors = Image(page.flat.width, page.flat.height, static_cast<int>(page.maps.size()));
  }
  const StudyMaps stored = mapsOf(baked->pages, mask_);
  const Sums near = compare(*encoding, stored, within30_), far = compare(*encoding, stored, within60_);
  study_.encodings.push_back({.name = name,
                              .maps = encoding->mapCount(),
                              .within30 = near.relativeError(),
                              .within60 = far.relativeError(),
                              .negative = far.truth > 0.0 ? far.negative / far.truth : 0.0,
                              .cpuSeconds = seconds});
  study_.meanFlat = meanOf(stored.flat);
  return {};
}

Expected<EncodingStudy> Studying::run() {
  auto atlas = atlasThatFits(scene_, options_.atlas, progress_);
  if (!atlas) return atlas.error();
  atlas_ = std::move(atlas->atlas);
  texels_ = findTexels(atlas_);
  auto lit = LitScene::build(scene_, options_.bounces != 0);
  if (!lit) return lit.error();
  lit_ = *std::move(lit);
  if (auto done = makeTruth(30.0, kNormals30, within30_); !done) return done.error();
  if (auto done = makeTruth(60.0, kNormals60, within60_); !done) return done.error();
  study_.texels = within30_.front().maps.flat.size();
  if (!(meanOf(within30_.front().maps.flat) > 0.0))
    return inputError("nothing in the scene is lit, so there is no error to study; give --sky-color or --sky");
  for (const EncodingSummary& summary : encodingSummaries()) {
    const auto encoding = findEncoding(summary.name, {{"projection", nameOf(options_.projection)}});
    if (!encoding) return encoding.error();
    if (auto done = measure(*encoding, summary.name); !done) return done.error();
    if (summary.name == "rnm" && options_.projection != Projection::Signed)
      if (auto done = measure(rnmEncoding(Projection::Signed), "rnm signed"); !done) return done.error();
    if (summary.name == "sh1") {
      const auto fitted = findEncoding("sh1", {{"projection", nameOf(Projection::Fit)}});
      if (!fitted) return fitted.error();
      if (auto done = measure(*fitted, "sh1 fit"); !done) return done.error();
      if (auto done = measure(std::make_shared<ConvertedSh1>(), "sh1 converted"); !done) return done.error();
    }
  }
  return std::move(study_);
}

std::string format(const char* how, double v) {
  char text[48];
  std::snprintf(text, sizeof text, how, v);
  return text;
}

std::string percent(double share) {
  return format(share >= 0.0995 ? "%.0f%%" : share >= 0.00995 ? "%.1f%%" : "%.2f%%", 100.0 * share);
}

constexpr int kFloatBytes = 12, kHalfBytes = 6;  // of a texel of an RGB map

}  // namespace

Expected<EncodingStudy> studyEncodings(const Scene& scene, const EncodingStudyOptions& options, Progress& progress) {
  return Studying(scene, options, progress).run();
}

std::string encodingStudyMarkdown(const EncodingStudy& study, const std::string& scene, int samples) {
  std::string md =
      "# Encodings of " + scene + "\n\n" + std::to_string(study.texels) + " texels, gather of " +
      std::to_string(samples) +
      " samples. The truth is irradiance for each of many normals, summed up from the same rays; errors "
      "are root mean squares over RGB relative to that of the truth. Negative light is what decoding "
      "cuts at zero, as a share of all light, over normals within 60 degrees.\n\n"
      "| encoding | bytes per texel, float | half | error within 30 degrees | within 60 degrees | negative "
      "light | CPU s |\n|---|---|---|---|---|---|---|\n";
  for (const EncodingFigures& e : study.encodings) {
    const auto maps = static_cast<int>(e.maps);
    md += "| " + e.name + " | " + std::to_string(kFloatBytes * maps) + " | " + std::to_string(kHalfBytes * maps) +
          " | " + percent(e.within30) + " | " + percent(e.within60) + " | " +
          (e.negative > 0.0 ? percent(e.negative) : "0") + " | " + format("%.2f", e.cpuSeconds) + " |\n";
  }
  return md;
}

Expected<void> writeEncodingStudy(const std::filesystem::path& dir, const EncodingStudy& study,
                                  const std::string& scene, int samples, const Json& settings) {
  Json rows = Json::array();
  for (const EncodingFigures& e : study.encodings)
    rows.push_back({{"encoding", e.name},
                    {"maps", e.maps},
                    {"bytesPerTexelFloat", kFloatBytes * e.maps},
                    {"bytesPerTexelHalf", kHalfBytes * e.maps},
                    {"errorWithin30", e.within30},
                    {"errorWithin60", e.within60},
                    {"negativeLight", e.negative},
                    {"cpuSeconds", e.cpuSeconds}});
  const Json json = {{"lumel", kVersion},          {"settings", settings}, {"texels", study.texels},
                     {"meanFlat", study.meanFlat}, {"samples", samples},   {"encodings", std::move(rows)}};
  auto files = FileSet::forFolder(dir);
  if (!files) return files.error();
  const auto write = [&](const std::string& name, const std::string& text) -> Expected<void> {
    const auto file = files->add(dir / name);
    if (!file) return file.error();
    return writeBytes(*file, text);
  };
  if (auto done = write("encodings.md", encodingStudyMarkdown(study, scene, samples)); !done) return done;
  if (auto done = write("encodings.json", json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"); !done)
    return done;
  return files->commitFolder({});
}

}  // namespace lumel
