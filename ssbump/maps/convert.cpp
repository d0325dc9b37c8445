#include "ssbump/maps/convert.h"

#include <cmath>

#include "scene/base/parallel.h"

namespace lumel::ssbump {
namespace {

Expected<LoadedImage> readMap(const std::filesystem::path& file, const Progress& progress) {
  auto loaded = readImage(file, progress);
  if (!loaded) return loaded.error();
  if (loaded->paletted) return inputError(file.string() + ": indexed colours; save it as RGB");
  if (loaded->image.channels < 3)
    return inputError(file.string() + ": has " + std::to_string(loaded->image.channels) +
                      " channel(s); an ssbump or normal map has three");
  const auto channels = static_cast<std::size_t>(loaded->image.channels),
             width = static_cast<std::size_t>(loaded->image.width);
  for (std::size_t i = 0; i < loaded->image.pixels.size(); ++i)
    if (!std::isfinite(loaded->image.pixels[i]))
      return inputError(file.string() + ": pixel (" + std::to_string(i / channels % width) + ", " +
                        std::to_string(i / channels / width) + ") is not a finite number; repair the map");
  return loaded;
}

void forEachTexel(Image& image, const std::function<Vec3(const Vec3&)>& map) {
  parallelFor(static_cast<std::size_t>(image.height), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t y = first; y < last; ++y)
      for (int x = 0; x < image.width; ++x)
        image.setRgb(x, static_cast<int>(y), map(image.rgb(x, static_cast<int>(y))));
  });
}

std::string metadataValue(const LoadedImage& image, const std::string& key) {
  const auto found = image.metadata.find(key);
  return found == image.metadata.end() ? "" : found->second;
}

/// The word after "key=" in a description line.
std::string wordAfter(const std::string& text, const std::string& key) {
  const std::size_t at = text.find(key + "=");
  if (at == std::string::npos) return "";
  const std::size_t from = at + key.size() + 1;
  return text.substr(from, text.find(' ', from) - from);
}

/// Blends and fades in the ssbump domain; a normal map has become squared weights before.
Expected<void> combine(Image& image, const Encoding& encoding, const MapForm& form, const ConvertSettings& settings,
                       const Progress& progress) {
  if (!settings.crossFade.empty()) {
    auto other = readMapAs(settings.crossFade, form, encoding, progress);
    if (!other) return other.error();
    auto faded = crossFade(image, *other, encoding, settings.crossFadeAmount);
    if (!faded) return faded.error();
    image = std::move(*faded);
  }
  if (!settings.detail.empty()) {
    auto detail = readMapAs(settings.detail, form, encoding, progress);
    if (!detail) return detail.error();
    blendDetail(image, *detail, encoding, settings.detailRepeats);
  }
  if (!settings.albedo.empty()) {
    auto albedo = readAlbedo(settings.albedo, progress);
    if (!albedo) return albedo.error();
    modulateByAlbedo(image, *albedo);
  }
  return {};
}

}  // namespace

std::optional<MapForm> formFromMetadata(const LoadedImage& image) {
  if (metadataValue(image, "lumel:content").starts_with("normal map"))
    return MapForm{{}, metadataValue(image, "lumel:green") == "down" ? Green::Down : Green::Up};
  std::string convention = metadataValue(image, "lumel:ssbump"), hand = metadataValue(image, "lumel:ssbump:hand");
  const std::string description = metadataValue(image, "ImageDescription");
  if (convention.empty() && description.starts_with("lumel ssbump")) {
    convention = wordAfter(description, "convention");
    hand = wordAfter(description, "hand");
  }
  const auto c = parseConvention(convention);
  const auto h = parseHand(hand);
  if (!c || !h) return std::nullopt;
  return MapForm{Encoding{*c, *h}, Green::Up};
}

Expected<Encoding> materialEncoding(const LoadedImage& image, const std::string& convention, const std::string& hand) {
  if (image.image.channels < 3) return inputError("has fewer than three channels; an ssbump map has three");
  const auto form = formFromMetadata(image);
  if (form && !form->encoding) return inputError("is a normal map; make an ssbump map from it (lumel ssbump --help)");
  if (image.image.channels > 4)
    return inputError("has " + std::to_string(image.image.channels) + " directions; a lightmap has the three RNM ones");
  Encoding encoding;
  if (form) encoding = *form->encoding;
  if (!convention.empty()) {
    const auto stated = parseConvention(convention);
    if (!stated) return stated.error();
    if (form && *stated != encoding.convention)
      return inputError(std::string("holds ") + nameOf(encoding.convention) + " weights by its metadata, and " +
                        convention + " by what the scene says");
    encoding.convention = *stated;
  }
  if (!hand.empty()) {
    const auto stated = parseHand(hand);
    if (!stated) return stated.error();
    if (form && *stated != encoding.hand)
      return inputError(std::string("is ") + nameOf(encoding.hand) + "-handed by its metadata, and " + hand +
                        "-handed by what the scene says");
    encoding.hand = *stated;
  }
  return encoding;
}

Expected<Image> readAlbedo(const std::filesystem::path& file, const Progress& progress) {
  auto loaded = readImage(file, progress);
  if (!loaded) return loaded.error();
  if (!loaded->isFloat)
    for (float& v : loaded->image.pixels) v = srgbToLinear(v);
  return std::move(loaded->image);
}

Expected<Image> readMapAs(const std::filesystem::path& file, const MapForm& form, const Encoding& encoding,
                          const Progress& progress) {
  auto loaded = readMap(file, progress);
  if (!loaded) return loaded.error();
  const MapForm own = formFromMetadata(*loaded).value_or(form);
  if (!own.encoding)
    forEachTexel(loaded->image, [&](const Vec3& c) { return normalWeights(decodeNormal(c, own.green)); });
  convert(loaded->image, own.encoding.value_or(Encoding{}), encoding);
  return std::move(loaded->image);
}

Expected<void> convertMap(const std::filesystem::path& input, const std::filesystem::path& output,
                          const ConvertSettings& settings, const Progress& progress) {
  auto loaded = readMap(input, progress);
  if (!loaded) return loaded.error();
  const auto form = settings.from ? settings.from : formFromMetadata(*loaded);
  if (!form)
    return inputError(input.string() +
                      ": nothing in the file says what it holds; give --from squared, linear, mod2x or normal");
  Image& image = loaded->image;
  const Encoding encoding = form->encoding.value_or(Encoding{});
  if (!form->encoding) forEachTexel(image, [&](const Vec3& c) { return normalWeights(decodeNormal(c, form->green)); });
  if (auto done = combine(image, encoding, *form, settings, progress); !done) return done;

  std::map<std::string, std::string> metadata;
  if (settings.to.encoding) {
    convert(image, encoding, *settings.to.encoding);
    metadata = encodingMetadata(*settings.to.encoding);
    metadata["lumel:content"] = "ssbump";
  } else {
    forEachTexel(image, [&](const Vec3& s) {
      const Vec3 squared = convert(s, encoding, Encoding{});
      return encodeNormal(recoveredNormal(squared), settings.to.green);
    });
    metadata["lumel:content"] = "normal map recovered from the ssbump map";
    metadata["lumel:green"] = settings.to.green == Green::Up ? "up" : "down";
  }
  FileSet files;
  auto writer = MapWriter::open(files, output, image.width, image.height, image.channels,
                                settings.to.encoding ? MapKind::Weights : MapKind::Normals, settings.options,
                                loaded->channelNames, metadata);
  if (!writer) return writer.error();
  if (auto done = writer->write(image, progress); !done) return done;
  if (auto done = writer->finish(files, progress); !done) return done;
  return files.commit();
}

}  // namespace lumel::ssbump
