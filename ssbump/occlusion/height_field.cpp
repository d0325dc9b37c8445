#include "ssbump/occlusion/height_field.h"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "scene/base/parallel.h"
#include "scene/files/file_access.h"

namespace lumel::ssbump {
namespace {

// Beyond this nothing but vertical walls is left, and float positions are too coarse for rays.
constexpr double kMaxHeightTexels = 1e6;

constexpr std::size_t kTexelsAtOnce = 1 << 16;

}  // namespace

float HeightField::at(int x, int y) const {
  if (wrap) return row(wrapIndex(y, height))[wrapIndex(x, width)];
  return row(std::clamp(y, 0, height - 1))[std::clamp(x, 0, width - 1)];
}

void HeightField::updateRange() {
  std::vector<std::pair<float, float>> ranges((texels.size() + kTexelsAtOnce - 1) / kTexelsAtOnce);
  parallelFor(texels.size(), kTexelsAtOnce, [&](std::size_t first, std::size_t last) {
    float low = texels[first], high = low;
    for (std::size_t i = first; i < last; ++i) {
      low = std::min(low, texels[i]);
      high = std::max(high, texels[i]);
    }
    ranges[first / kTexelsAtOnce] = {low, high};
  });
  std::tie(lowest, highest) = ranges.at(0);
  for (const auto& [low, high] : ranges) {
    lowest = std::min(lowest, low);
    highest = std::max(highest, high);
  }
}

Expected<void> parseHeightScale(const std::string& text, HeightOptions& options) {
  const bool percent = !text.empty() && text.back() == '%';
  const char* end = text.data() + text.size() - (percent ? 1 : 0);
  double value = 0;
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value))
    return usageError("--height-scale " + text + ": not a number; give texels (24) or a share of the width (5%)");
  options.scale = value;
  options.scaleIsPercent = percent;
  return {};
}

Expected<int> findChannel(const LoadedImage& image, const std::string& channel, const std::string& name) {
  if (channel.empty()) return 0;
  std::string wanted = lowerCase(channel);
  if (wanted == "red" || wanted == "green" || wanted == "blue" || wanted == "alpha") wanted.resize(1);
  std::string known;
  for (std::size_t i = 0; i < image.channelNames.size(); ++i) {
    if (lowerCase(image.channelNames[i]) == wanted) return static_cast<int>(i);
    known += (i ? ", " : "") + image.channelNames[i];
  }
  if (wanted == "luminance" && image.image.channels >= 3) return -1;
  int index = 0;
  const auto [stop, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), index);
  if (error == std::errc() && stop == wanted.data() + wanted.size() && index >= 0 && index < image.image.channels)
    return index;
  return inputError(name + ": no channel '" + channel + "'; the image has " + known);
}

bool looksLikeNormalMap(const Image& image) {
  if (image.channels < 3) return false;
  std::size_t unit = 0, flatUp = 0, tested = 0;
  const std::size_t pixels = image.pixels.size() / static_cast<std::size_t>(image.channels);
  const std::size_t stride = std::max<std::size_t>(1, pixels / 65536);
  for (std::size_t i = 0; i < pixels; i += stride, ++tested) {
    const float* p = &image.pixels[i * static_cast<std::size_t>(image.channels)];
    const Vec3 n(2 * p[0] - 1, 2 * p[1] - 1, 2 * p[2] - 1);
    // 8 bits, JPEG and mipmaps shorten normals a little; a photograph does not stay within this shell.
    if (std::abs(glm::length(n) - 1) < 0.15f && n.z > 0.1f) ++unit;
    if (n.z > 0.5f && std::max(std::abs(n.x), std::abs(n.y)) < n.z) ++flatUp;
  }
  return unit > tested * 9 / 10 && flatUp > tested / 2;
}

namespace {

/// A table of greys is how some formats store grey: those are heights all the same.
bool isGrey(const Image& image) {
  for (std::size_t i = 0; image.channels >= 3 && i < image.pixels.size(); i += static_cast<std::size_t>(image.channels))
    if (image.pixels[i] != image.pixels[i + 1] || image.pixels[i] != image.pixels[i + 2]) return false;
  return true;
}

/// The chosen channel as one plane, in place of the interleaved pixels.
void keepChannel(Image& image, int channel) {
  const auto channels = static_cast<std::size_t>(image.channels);
  const std::size_t pixels = image.pixels.size() / channels;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* p = &image.pixels[i * channels];
    image.pixels[i] = channel < 0 ? luminance({p[0], p[1], p[2]}) : p[channel];
  }
  image.pixels.resize(pixels);
  if (channels > 1) image.pixels.shrink_to_fit();
  image.channels = 1;
}

}  // namespace

Expected<HeightField> heightFieldFromImage(LoadedImage&& loaded, const HeightOptions& options,
                                           const std::string& name) {
  if (loaded.paletted && !isGrey(loaded.image))
    return inputError(name + ": indexed colours hold no heights; save it as 8- or 16-bit grey");
  if (options.channel.empty() && looksLikeNormalMap(loaded.image))
    return inputError(name + ": looks like a normal map, not heights; give it as --normal-map beside a height map, " +
                      "use --convert for weights without shadows, or choose a channel with --channel");
  auto channel = findChannel(loaded, options.channel, name);
  if (!channel) return channel.error();
  keepChannel(loaded.image, *channel);

  HeightField field;
  field.width = loaded.image.width;
  field.height = loaded.image.height;
  field.wrap = options.wrap;
  field.texels = std::move(loaded.image.pixels);
  const double scale = options.scaleIsPercent ? options.scale / 100 * field.width : options.scale;
  const auto heightOf = [&](double value) { return scale * (options.invert ? 1 - value : value); };
  std::atomic<std::size_t> firstWrong{field.texels.size()};
  parallelFor(field.texels.size(), kTexelsAtOnce, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const double texels = heightOf(field.texels[i]);
      if (std::abs(texels) <= kMaxHeightTexels) {
        field.texels[i] = static_cast<float>(texels);
        continue;
      }
      for (std::size_t known = firstWrong; i < known && !firstWrong.compare_exchange_weak(known, i);) {
      }
      return;
    }
  });
  if (const std::size_t i = firstWrong; i < field.texels.size()) {
    const std::size_t width = static_cast<std::size_t>(field.width);
    const std::string place = name + ": pixel (" + std::to_string(i % width) + ", " + std::to_string(i / width) + ")";
    if (!std::isfinite(field.texels[i]))
      return inputError(place + ": the height is not a finite number; repair the map");
    return inputError(place + ": a height of " + std::to_string(heightOf(field.texels[i])) +
                      " texels; at most 1000000 make sense, lower --height-scale");
  }
  field.updateRange();
  return field;
}

Vec3 heightNormal(const HeightField& field, int x, int y) {
  // One-sided at an edge that does not wrap, where the clamped neighbour is the texel itself.
  const float stepX = !field.wrap && (x == 0 || x == field.width - 1) ? 1.0f : 2.0f;
  const float stepY = !field.wrap && (y == 0 || y == field.height - 1) ? 1.0f : 2.0f;
  const float slopeT = (field.at(x + 1, y) - field.at(x - 1, y)) / stepX;
  const float slopeB = (field.at(x, y - 1) - field.at(x, y + 1)) / stepY;
  return glm::normalize(Vec3(-slopeT, -slopeB, 1.0f));
}

}  // namespace lumel::ssbump
