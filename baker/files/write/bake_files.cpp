#include "baker/files/write/bake_files.h"

#include <algorithm>
#include <set>

#include "baker/files/names/conventions.h"
#include "baker/files/names/file_names.h"
#include "baker/files/names/version.h"
#include "baker/files/write/bake_json.h"
#include "baker/files/write/glb_writer.h"
#include "baker/files/write/volume_files.h"
#include "scene/base/parallel.h"
#include "scene/images/image_io.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

std::map<std::string, std::string> pageMetadata(std::size_t page, const std::string& kind, const BakeRecord& record) {
  std::map<std::string, std::string> metadata;
  const std::vector<StoredEncoding> all = record.bakeOptions.encoding->stored();
  const auto has = [&kind](const StoredEncoding& stored) {
    return std::ranges::find(stored.encoding->mapNames(), kind) != stored.encoding->mapNames().end();
  };
  const auto found = std::ranges::find_if(all, has);
  const Encoding& encoding = found == all.end() ? *all.front().encoding : *found->encoding;
  for (const auto& [key, text] : describeConventions(encoding)) metadata["lumel:" + key] = text;
  metadata["lumel:encoding"] = encoding.name();
  for (const std::string& name : encoding.mapNames())
    metadata["lumel:maps"] += (metadata["lumel:maps"].empty() ? "" : " ") + name;
  metadata["lumel:version"] = kVersion;
  metadata["lumel:page"] = std::to_string(page);
  metadata["lumel:map"] = kind;
  metadata["lumel:integrator"] = nameOf(record.bakeOptions.integrator);
  metadata["lumel:samples"] = std::to_string(record.bakeOptions.samples);
  metadata["lumel:bounces"] = describeBounces(record.bakeOptions.bounces);
  metadata["lumel:seed"] = std::to_string(record.bakeOptions.seed);
  metadata["lumel:dilate"] = std::to_string(record.dilate);
  if (kind == "masks")
    metadata["lumel:units"] =
        "share of a lamp's irradiance that arrives, 0..1; lamps by channel: shadowMasks in bake.json";
  if (kind == "aux")
    metadata["lumel:units"] =
        "coverage: area share 0..1; validity: share of gather rays that met no back face; stderr, stderr0 and so on: "
        "standard error of the luminance of the flat map and of the maps in their order, as they are in these files, "
        "NaN where it is not known; samples: gather rays";
  if (kind == "aux" || kind == "masks")
    for (const char* key : {"decode", "decodeFormula", "basis", "order", "encoding"})
      metadata.erase(std::string("lumel:") + key);
  return metadata;
}

/// One image of a bake on its way to its file.
struct ImageFile {
  PendingFile file;
  const Image* image;
  WriteImageOptions options;
  // Whose channels come after those of `image`: as many as have names, from this one on.
  const Image* more = nullptr;
  std::size_t firstOfMore = 0;
};

/// The channels of both, pixel by pixel.
Image joined(const ImageFile& file) {
  const Image& first = *file.image;
  Image image(first.width, first.height, static_cast<int>(file.options.channelNames.size()));
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      std::copy_n(first.at(x, y), first.channels, image.at(x, y));
      std::copy_n(file.more->at(x, y) + file.firstOfMore, image.channels - first.channels,
                  image.at(x, y) + first.channels);
    }
  return image;
}

Expected<void> addPage(FileSet& set, const fs::path& dir, std::size_t page, const BakedPage& baked, const Image* masks,
                       const BakeRecord& record, std::vector<ImageFile>& files) {
  WriteImageOptions options;
  options.format = record.half ? PixelFormat::Half : PixelFormat::Float;
  options.noisy = !record.half;
  const auto add = [&](const std::string& kind, const Image& image, const Image* more = nullptr,
                       std::size_t firstOfMore = 0) -> Expected<void> {
    options.metadata = pageMetadata(page, kind, record);
    auto file = set.add(dir / pageFileName(page, kind));
    if (!file) return file.error();
    files.push_back({std::move(*file), &image, options, more, firstOfMore});
    return {};
  };
  std::size_t map = 0;
  for (const StoredEncoding& stored : record.bakeOptions.encoding->stored())
    for (const std::string& kind : stored.encoding->mapNames())
      if (kind != kFlatMap)
        if (auto added = add(kind, baked.maps[map++]); !added) return added;
  if (auto added = add(kFlatMap, baked.flat); !added) return added;
  if (masks != nullptr)
    if (auto added = add("masks", *masks); !added) return added;
  // Sample counts and coverage are exact in float only.
  options.format = PixelFormat::Float;
  options.noisy = false;
  options.mayHoldNan = true;
  const StoredEncoding first = record.bakeOptions.encoding->stored().front();
  options.channelNames = auxChannels(*first.encoding);
  return add("aux", baked.aux, &baked.mapErrors, first.first);
}

/// Compression takes most of the time, and a file at a time leaves cores idle.
Expected<void> writeImages(const std::vector<ImageFile>& files) {
  std::vector<Expected<void>> done(files.size());
  parallelFor(files.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const ImageFile& file = files[i];
      done[i] = file.more == nullptr ? writeImage(file.file, *file.image, file.options)
                                     : writeImage(file.file, joined(file), file.options);
    }
  });
  for (Expected<void>& d : done)
    if (!d) return std::move(d);
  return {};
}

}  // namespace

Expected<void> writeBake(const fs::path& dir, const Scene& scene, const AtlasResult& atlas, const BakeResult& result,
                         const BakeRecord& record) {
  auto set = FileSet::forFolder(dir);
  if (!set) return set.error();
  std::vector<ImageFile> files;
  for (std::size_t page = 0; page < result.pages.size(); ++page)
    if (auto added = addPage(*set, dir, page, result.pages[page],
                             page < result.shadowMasks.size() ? &result.shadowMasks[page] : nullptr, record, files);
        !added)
      return added;
  if (!scene.environment.isBlack() && !scene.environment.image.empty()) {
    auto sky = set->add(dir / "sky.exr");
    if (!sky) return sky.error();
    files.push_back({std::move(*sky), &scene.environment.image, {}, nullptr, 0});
  }
  if (auto done = writeImages(files); !done) return done;
  const auto writeFile = [&](const char* name, const auto& bytes) -> Expected<void> {
    const auto file = set->add(dir / name);
    if (!file) return file.error();
    return writeBytes(*file, bytes);
  };
  std::set<int> ssbumpMaps;
  for (const Material& material : scene.materials)
    if (material.ssbumpMap) ssbumpMaps.insert(material.ssbumpMap.image);
  for (const int image : ssbumpMaps) {
    const ImageSource& source = scene.images[static_cast<std::size_t>(image)];
    const std::string name = ssbumpFileName(image, source.mimeType);
    if (auto done = writeFile(name.c_str(), std::span(&source.encoded, 1)); !done) return done;
  }
  for (std::size_t number = 0; number < result.volumes.size(); ++number)
    if (auto done = writeVolume(*set, dir, number, result.volumes[number], record.half); !done) return done;
  const auto glb = encodeGlb(scene, atlas.atlas, record.sceneForm);
  if (!glb) return glb.error();
  if (auto done = writeFile("scene.glb", std::span<const std::vector<std::uint8_t>>(*glb)); !done) return done;
  if (auto done = writeFile("bake.json", describeBake(scene, atlas, result, record)); !done) return done;
  return set->commitFolder(isBakeFile);
}

}  // namespace lumel
