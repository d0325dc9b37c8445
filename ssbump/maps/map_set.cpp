#include "ssbump/maps/map_set.h"

#include <algorithm>
#include <functional>

#include "lightmap/maps/rnm_basis.h"
#include "scene/base/check.h"
#include "scene/base/parallel.h"
#include "ssbump/maps/convert.h"

namespace lumel::ssbump {
namespace {

Expected<Image> readMask(const std::filesystem::path& file, int width, int height, const Progress& progress) {
  auto loaded = readImage(file, progress);
  if (!loaded) return loaded.error();
  if (loaded->image.width != width || loaded->image.height != height)
    return inputError(file.string() + ": the mask is " + std::to_string(loaded->image.width) + "x" +
                      std::to_string(loaded->image.height) + ", the map " + std::to_string(width) + "x" +
                      std::to_string(height) + "; make them the same size");
  Image plane(width, height, 1);
  for (std::size_t i = 0; i < plane.pixels.size(); ++i)
    plane.pixels[i] = loaded->image.pixels[i * static_cast<std::size_t>(loaded->image.channels)];
  return plane;
}

void forEachTexel(Image& image, const std::function<void(int, int)>& body) {
  parallelFor(static_cast<std::size_t>(image.height), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t y = first; y < last; ++y)
      for (int x = 0; x < image.width; ++x) body(x, static_cast<int>(y));
  });
}

std::vector<std::string> channelNames(std::size_t count, bool alpha) {
  std::vector<std::string> names;
  if (count != 3)
    for (std::size_t i = 0; i < count; ++i) names.push_back("B" + std::to_string(i));
  else
    names = {"R", "G", "B"};
  if (alpha) names.push_back("A");
  return names;
}

Expected<void> checkBasis(const MapSettings& settings) {
  if (settings.basis.empty()) return {};
  if (settings.encoding.hand == Hand::Left)
    return usageError("--hand left is a swap of the RNM basis's channels; it does not go with --basis");
  if (settings.basis.size() != 3 && (!settings.detail.empty() || !settings.files.recovered.empty()))
    return usageError("--detail and --save-recovered need the three RNM vectors; leave out --basis");
  return {};
}

std::string textOf(std::span<const Vec3> basis) {
  std::string text;
  for (const Vec3& v : basis)
    text += std::to_string(v.x) + " " + std::to_string(v.y) + " " + std::to_string(v.z) + "; ";
  return text;
}

}  // namespace

Expected<MapSet> MapSet::open(const MapSettings& settings, int width, int height, Image alpha,
                              std::map<std::string, std::string> metadata, const Progress& progress) {
  if (auto good = checkBasis(settings); !good) return good.error();
  MapSet set;
  set.settings_ = settings;
  set.width_ = width;
  set.height_ = height;
  set.alpha_ = std::move(alpha);
  if (auto done = set.readImages(progress); !done) return done.error();

  const bool rnm = settings.basis.empty();
  const std::span<const Vec3> basis = rnm ? std::span<const Vec3>(kRnmBasis) : std::span<const Vec3>(settings.basis);
  set.basisSize_ = basis.size();
  for (const Vec3& axis : basis) set.lobes_.push_back({axis, settings.lobe, settings.coneOpeningDegrees});
  if (!settings.files.ambient.empty()) set.lobes_.push_back(ambientLobe());

  for (const auto& [key, value] : encodingMetadata(settings.encoding)) metadata[key] = value;
  if (!rnm) metadata["lumel:ssbump:basis"] = textOf(basis);
  metadata["lumel:green"] = settings.green == Green::Up ? "up" : "down";
  if (auto done = set.openFiles(metadata); !done) return done.error();
  return set;
}

Expected<void> MapSet::readImages(const Progress& progress) {
  if (!settings_.mask.empty()) {
    auto mask = readMask(settings_.mask, width_, height_, progress);
    if (!mask) return mask.error();
    alpha_ = std::move(*mask);
  }
  if (!settings_.albedo.empty()) {
    auto albedo = readAlbedo(settings_.albedo, progress);
    if (!albedo) return albedo.error();
    albedo_ = std::move(*albedo);
  }
  if (!settings_.detail.empty()) {
    auto detail = readMapAs(settings_.detail, {settings_.encoding, Green::Up}, settings_.encoding, progress);
    if (!detail) return detail.error();
    detail_ = std::move(*detail);
  }
  return {};
}

Expected<void> MapSet::openFiles(const std::map<std::string, std::string>& metadata) {
  const MapFiles& f = settings_.files;
  const bool hasAlpha = !alpha_.empty();
  struct Output {
    const std::filesystem::path& file;
    std::optional<MapWriter>& writer;
    std::vector<std::string> channels;
    MapKind kind;
    const char* content;
  };
  const std::vector<std::string> rgb = channelNames(3, false), grey{"Y"};
  const std::vector<std::string> basisChannels = basisSize_ == 1 ? grey : channelNames(basisSize_, false);
  const Output outputs[] = {
      {f.ssbump, ssbump_, hasAlpha ? channelNames(basisSize_, true) : basisChannels, MapKind::Weights, "ssbump"},
      {f.weights, weights_, basisChannels, MapKind::Weights, "weights without occlusion"},
      {f.occlusion, occlusion_, basisChannels, MapKind::Weights, "visibility around each basis vector"},
      {f.ambient, ambient_, grey, MapKind::Weights, "cosine-weighted visibility"},
      {f.normal, normal_, rgb, MapKind::Normals, "normal map"},
      {f.recovered, recovered_, rgb, MapKind::Normals, "normal map recovered from the ssbump map"}};
  for (const Output& output : outputs) {
    if (output.file.empty()) continue;
    auto own = metadata;
    own["lumel:content"] = output.content;
    auto opened = MapWriter::open(files_, output.file, width_, height_, static_cast<int>(output.channels.size()),
                                  output.kind, settings_.options, output.channels, std::move(own));
    if (!opened) return opened.error();
    output.writer.emplace(std::move(*opened));
  }
  return {};
}

Image MapSet::compose(const Image& normals, const Image& occlusion, bool withOcclusion) const {
  const std::size_t n = basisSize_;
  Image out(normals.width, normals.height, static_cast<int>(n));
  forEachTexel(out, [&](int x, int y) {
    const std::span<float> s(out.at(x, y), n);
    normalWeights(normals.rgb(x, y), settings_.encoding.convention, settings_.basis, s);
    if (withOcclusion)
      for (std::size_t i = 0; i < n; ++i) s[i] *= occlusion.at(x, y)[i];
    if (settings_.encoding.hand == Hand::Left && n == 3) std::swap(s[1], s[2]);
  });
  return out;
}

void MapSet::modulate(Image& rows) const {
  const float detailScale = 1 / (3 * flatValue(settings_.encoding.convention));
  if (albedo_.empty() && detail_.empty()) return;
  forEachTexel(rows, [&](int x, int y) {
    const float u = (static_cast<float>(x) + 0.5f) / static_cast<float>(width_);
    const float v = (static_cast<float>(y + row_) + 0.5f) / static_cast<float>(height_);
    float factor = 1;
    if (!albedo_.empty()) factor *= luminance(sampleRepeated(albedo_, u, v));
    if (!detail_.empty()) {
      const Vec3 d = sampleRepeated(detail_, u * settings_.detailRepeats, v * settings_.detailRepeats);
      factor *= (d.x + d.y + d.z) * detailScale;
    }
    for (std::size_t i = 0; i < basisSize_; ++i) rows.at(x, y)[i] *= factor;
  });
}

void MapSet::addAlpha(Image& rows) const {
  if (alpha_.empty()) return;
  Image with(rows.width, rows.height, rows.channels + 1);
  forEachTexel(with, [&](int x, int y) {
    std::copy_n(rows.at(x, y), rows.channels, with.at(x, y));
    with.at(x, y)[rows.channels] = *alpha_.at(x, row_ + y);
  });
  rows = std::move(with);
}

Expected<void> MapSet::write(const Image& normals, const Image& occlusion, const Progress& progress) {
  LUMEL_CHECK(normals.width == width_ && occlusion.width == width_ && normals.height == occlusion.height);
  LUMEL_CHECK(static_cast<std::size_t>(occlusion.channels) == lobes_.size());
  Image ssbump = compose(normals, occlusion, true);
  modulate(ssbump);
  const auto perTexel = [&](std::size_t channels, const std::function<void(int x, int y, float* out)>& value) {
    Image out(normals.width, normals.height, static_cast<int>(channels));
    forEachTexel(out, [&](int x, int y) { value(x, y, out.at(x, y)); });
    return out;
  };
  const auto setNormal = [&](const Vec3& n, float* out) {
    const Vec3 stored = encodeNormal(n, settings_.green);
    std::copy_n(&stored.x, 3, out);
  };
  const auto recovered = [&](int x, int y, float* out) {
    const Encoding& own = settings_.encoding;
    setNormal(recoveredNormal(convert(ssbump.rgb(x, y), own, {own.convention, Hand::Right}), own.convention), out);
  };
  struct Output {
    std::optional<MapWriter>& writer;
    std::function<Image()> make;
  };
  const Output outputs[] = {
      {weights_, [&] { return compose(normals, occlusion, false); }},
      {occlusion_,
       [&] {
         return perTexel(basisSize_,
                         [&](int x, int y, float* out) { std::copy_n(occlusion.at(x, y), basisSize_, out); });
       }},
      {ambient_, [&] { return perTexel(1, [&](int x, int y, float* out) { *out = occlusion.at(x, y)[basisSize_]; }); }},
      {normal_, [&] { return perTexel(3, [&](int x, int y, float* out) { setNormal(normals.rgb(x, y), out); }); }},
      {recovered_, [&] { return perTexel(3, recovered); }}};
  for (const Output& output : outputs)
    if (output.writer)
      if (auto done = output.writer->write(output.make(), progress); !done) return done;
  addAlpha(ssbump);
  row_ += normals.height;
  return ssbump_ ? ssbump_->write(ssbump, progress) : Expected<void>();
}

Expected<void> MapSet::commit(const Progress& progress) {
  LUMEL_CHECK(row_ == height_);
  for (auto* writer : {&weights_, &occlusion_, &ambient_, &normal_, &recovered_, &ssbump_})
    if (*writer)
      if (auto done = (*writer)->finish(files_, progress); !done) return done;
  return files_.commit();
}

std::vector<std::string> MapSet::warnings() const {
  std::vector<std::string> all;
  for (const auto* writer : {&ssbump_, &weights_})
    if (*writer && (*writer)->clipped() > 0)
      all.push_back((*writer)->file().string() + ": " + std::to_string((*writer)->clipped()) +
                    " values beyond 0..1 were cut; float formats or --convention squared hold them");
  return all;
}

}  // namespace lumel::ssbump
