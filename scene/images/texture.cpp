#include "scene/images/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/images/image_io.h"

namespace lumel {
namespace {

using Table = std::array<float, 256>;

Table makeTable(ColorSpace space) {
  Table table;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const float value = static_cast<float>(i) / 255.0f;
    table[i] = space == ColorSpace::Srgb ? srgbToLinear(value) : value;
  }
  return table;
}

const Table& tableOf(ColorSpace space) {
  static const Table srgb = makeTable(ColorSpace::Srgb);
  static const Table linear = makeTable(ColorSpace::Linear);
  return space == ColorSpace::Srgb ? srgb : linear;
}

/// The byte whose linear value is nearest.
std::uint8_t encodeSrgb(float linear) {
  constexpr float kSteps = 65535.0f;
  static const std::vector<std::uint8_t> nearest = [] {
    const Table& values = tableOf(ColorSpace::Srgb);
    std::vector<std::uint8_t> made;
    for (std::size_t byte = 0; made.size() <= static_cast<std::size_t>(kSteps);
         made.push_back(static_cast<std::uint8_t>(byte)))
      while (byte < 255 && static_cast<float>(made.size()) / kSteps > 0.5f * (values[byte] + values[byte + 1])) ++byte;
    return made;
  }();
  return nearest[static_cast<std::size_t>(std::clamp(linear, 0.0f, 1.0f) * kSteps + 0.5f)];
}

/// The texels of a finer level that one of a coarser level covers along an axis, the outer ones in part.
struct Covered {
  int first = 0;
  int count = 0;
  std::array<float, 3> shares{};
};

/// Texel i of n covers i * size / n to (i + 1) * size / n; size < 3 n, or n = 1.
std::vector<Covered> coveredBy(int n, int size) {
  std::vector<Covered> all(static_cast<std::size_t>(n));
  for (std::int64_t i = 0; i < n; ++i) {
    Covered& covered = all[static_cast<std::size_t>(i)];
    const std::int64_t begin = i * size, end = begin + size;  // times n
    covered.first = static_cast<int>(begin / n);
    for (std::int64_t source = covered.first; source * n < end; ++source)
      covered.shares[static_cast<std::size_t>(covered.count++)] =
          static_cast<float>(std::min((source + 1) * n, end) - std::max(source * n, begin)) / static_cast<float>(size);
  }
  return all;
}

/// Texel index for a coordinate that may lie outside the image.
int wrapTexel(std::int64_t i, int size, Wrap mode) {
  const std::int64_t n = size;
  if (i >= 0 && i < n) return static_cast<int>(i);
  switch (mode) {
    case Wrap::Clamp:
      return static_cast<int>(std::clamp<std::int64_t>(i, 0, n - 1));
    case Wrap::Mirror: {
      const std::int64_t m = wrapIndex(i, 2 * n);
      return static_cast<int>(m < n ? m : 2 * n - 1 - m);
    }
    default:
      return static_cast<int>(wrapIndex(i, n));
  }
}

/// (std::floor is a call where processors without SSE 4.1 are served.)
std::int64_t floorOf(float x) {
  const auto towardsZero = static_cast<std::int64_t>(x);
  return x < static_cast<float>(towardsZero) ? towardsZero - 1 : towardsZero;
}

/// Far from the origin a float UV no longer tells texels apart; limits keep the integer arithmetic defined.
float tameCoordinate(float uv) { return std::isfinite(uv) ? std::clamp(uv, -1e6f, 1e6f) : 0.0f; }

}  // namespace

Expected<Texture> Texture::decode(const ImageSource& source, ColorSpace space) {
  if (source.encoded.empty()) return inputError(source.name + ": the image is missing");
  auto loaded = readImage(source.encoded, source.name, PixelsAs::Stored);
  if (!loaded) return loaded.error();
  Texture texture;
  texture.width_ = loaded->image.width;
  texture.height_ = loaded->image.height;
  texture.space_ = space;
  const std::size_t texels = static_cast<std::size_t>(texture.width_) * static_cast<std::size_t>(texture.height_);
  const auto channels = static_cast<std::size_t>(loaded->image.channels);
  const bool bytes = !loaded->bytes.empty();
  texture.bytes_.resize(bytes ? 3 * texels : 0);
  texture.alphaBytes_.resize(bytes ? texels : 0);
  texture.floats_.resize(bytes ? 0 : 4 * texels);
  const auto rgbaOf = [&](const auto* in, auto opaque) {
    const bool grey = channels < 3;
    return std::array{in[0], grey ? in[0] : in[1], grey ? in[0] : in[2],
                      channels >= 4   ? in[3]
                      : channels == 2 ? in[1]
                                      : opaque};
  };
  for (std::size_t t = 0; t < texels; ++t) {
    if (bytes) {
      const auto rgba = rgbaOf(&loaded->bytes[t * channels], std::uint8_t{255});
      for (std::size_t c = 0; c < 4; ++c) texture.byteOf(t, c) = rgba[c];
      continue;
    }
    const auto rgba = rgbaOf(&loaded->image.pixels[t * channels], 1.0f);
    // Float files (EXR, HDR) are linear already; 16-bit ones are encoded as 8-bit ones are.
    for (std::size_t c = 0; c < 4; ++c)
      texture.floats_[4 * t + c] =
          space == ColorSpace::Srgb && c < 3 && !loaded->isFloat ? srgbToLinear(rgba[c]) : rgba[c];
  }
  texture.sortAlpha();
  return texture;
}

void Texture::sortAlpha() {
  alphaBlocks_.assign(blockOf(width_ - 1, height_ - 1) + 1, 0);
  opaque_ = true;
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const float alpha = fetchAlpha(x, y);
      opaque_ = opaque_ && alpha == 1.0f;
      alphaBlocks_[blockOf(x, y)] |=
          static_cast<std::uint8_t>((alpha != 1.0f ? kSomeTransparent : 0) | (alpha != 0.0f ? kSomeVisible : 0));
    }
  if (!opaque_) return;
  alphaBlocks_ = std::vector<std::uint8_t>();  // `= {}` would keep the memory
  alphaBytes_ = std::vector<std::uint8_t>();
}

Vec4 Texture::fetch(int x, int y) const {
  const std::size_t texel = texelAt(x, y);
  if (bytes_.empty()) {
    const float* rgba = &floats_[4 * texel];
    return {rgba[0], rgba[1], rgba[2], rgba[3]};
  }
  const Table& table = tableOf(space_);
  const std::uint8_t* rgb = &bytes_[3 * texel];
  return {table[rgb[0]], table[rgb[1]], table[rgb[2]], fetchAlpha(x, y)};
}

float Texture::fetchAlpha(int x, int y) const {
  if (bytes_.empty()) return floats_[4 * texelAt(x, y) + 3];
  return alphaBytes_.empty() ? 1.0f : static_cast<float>(alphaBytes_[texelAt(x, y)]) / 255.0f;
}

Texture::Footprint Texture::footprint(const TextureRef& ref, Vec2 uv) const {
  const Vec3 transformed = ref.uvMatrix * Vec3(uv, 1.0f);
  const float offset = ref.nearest ? 0.0f : 0.5f;
  const float x = tameCoordinate(transformed.x) * static_cast<float>(width_) - offset;
  const float y = tameCoordinate(transformed.y) * static_cast<float>(height_) - offset;
  const std::int64_t left = floorOf(x), top = floorOf(y);
  const std::int64_t further = ref.nearest ? 0 : 1;
  Footprint at{{wrapTexel(left, width_, ref.wrapU), wrapTexel(left + further, width_, ref.wrapU)},
               {wrapTexel(top, height_, ref.wrapV), wrapTexel(top + further, height_, ref.wrapV)}};
  if (ref.nearest) return at;
  at.fx = x - static_cast<float>(left);
  at.fy = y - static_cast<float>(top);
  return at;
}

Vec4 Texture::sample(const Footprint& at) const {
  const auto mean = [&](const auto& valueAt) {
    const auto row = [&](int y) { return glm::mix(valueAt(at.columns[0], y), valueAt(at.columns[1], y), at.fx); };
    return glm::mix(row(at.rows[0]), row(at.rows[1]), at.fy);
  };
  if (bytes_.empty() || !opaque_) return mean([&](int x, int y) { return fetch(x, y); });
  const Table& table = tableOf(space_);
  return Vec4(mean([&](int x, int y) {
                const std::uint8_t* rgb = &bytes_[3 * texelAt(x, y)];
                return Vec3(table[rgb[0]], table[rgb[1]], table[rgb[2]]);
              }),
              1.0f);
}

float Texture::sampleAlpha(const TextureRef& ref, Vec2 uv) const {
  if (opaque_) return 1.0f;
  const Footprint at = footprint(ref, uv);
  if (!alphaBlocks_.empty()) {
    int kinds = 0;
    for (const int y : at.rows)
      for (const int x : at.columns) kinds |= alphaBlocks_[blockOf(x, y)];
    if (kinds == kSomeVisible) return 1.0f;
    if (kinds == kSomeTransparent) return 0.0f;
  }
  if (ref.nearest) return fetchAlpha(at.columns[0], at.rows[0]);
  const auto row = [&](int y) { return glm::mix(fetchAlpha(at.columns[0], y), fetchAlpha(at.columns[1], y), at.fx); };
  return glm::mix(row(at.rows[0]), row(at.rows[1]), at.fy);
}

void Texture::prefetch(const Footprint& at) const {
  // It is enough to ask for the left texels of both rows: the right ones mostly share their cache lines.
  for (const int y : at.rows) {
    const std::size_t texel = texelAt(at.columns[0], y);
    if (bytes_.empty())
      __builtin_prefetch(&floats_[4 * texel]);
    else
      __builtin_prefetch(&bytes_[3 * texel]);
  }
}

/// Rounded where the texture holds bytes.
void Texture::set(int x, int y, const Vec4& rgba) {
  const std::size_t texel = texelAt(x, y);
  for (int c = 0; c < 4; ++c) {
    const auto channel = static_cast<std::size_t>(c);
    if (bytes_.empty())
      floats_[4 * texel + channel] = rgba[c];
    else if (c < 3 || !alphaBytes_.empty())
      byteOf(texel, channel) = space_ == ColorSpace::Srgb && c < 3
                                   ? encodeSrgb(rgba[c])
                                   : static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(rgba[c], 0.0f, 1.0f)));
  }
}

Texture Texture::halved() const {
  Texture half;
  half.width_ = std::max(width_ / 2, 1);
  half.height_ = std::max(height_ / 2, 1);
  half.space_ = space_;
  half.opaque_ = opaque_;
  const std::size_t texels = static_cast<std::size_t>(half.width_) * static_cast<std::size_t>(half.height_);
  half.floats_.resize(bytes_.empty() ? 4 * texels : 0);
  half.bytes_.resize(bytes_.empty() ? 0 : 3 * texels);
  half.alphaBytes_.resize(alphaBytes_.empty() ? 0 : texels);
  const std::vector<Covered> columns = coveredBy(half.width_, width_);
  const std::vector<Covered> rows = coveredBy(half.height_, height_);
  for (int y = 0; y < half.height_; ++y) {
    const Covered& down = rows[static_cast<std::size_t>(y)];
    // What rounding to bytes takes from one texel the next one gets: else each level would be .1% brighter or darker.
    Vec4 owed(0.0f);
    for (int x = 0; x < half.width_; ++x) {
      const Covered& across = columns[static_cast<std::size_t>(x)];
      Vec4 mean(0.0f);
      for (int v = 0; v < down.count; ++v)
        for (int u = 0; u < across.count; ++u)
          mean += across.shares[u] * down.shares[v] * fetch(across.first + u, down.first + v);
      owed += mean;
      half.set(x, y, owed);
      owed = bytes_.empty() ? Vec4(0.0f) : owed - half.fetch(x, y);
    }
  }
  return half;
}

TexturePyramid::TexturePyramid(Texture finest, bool coarser) {
  levels_.push_back(std::move(finest));
  while (coarser && (levels_.back().width() > 1 || levels_.back().height() > 1))
    levels_.push_back(levels_.back().halved());
}

float TexturePyramid::exactLevel(const TextureRef& ref, float uvWidth) const {
  const Texture& finest = levels_.front();
  const float stretch = std::sqrt(std::abs(glm::determinant(glm::mat2(ref.uvMatrix))));
  const float texels =
      uvWidth * stretch * std::sqrt(static_cast<float>(finest.width()) * static_cast<float>(finest.height()));
  return texels > 1.0f ? std::min(std::log2(texels), static_cast<float>(levels_.size() - 1)) : 0.0f;
}

const Texture& TexturePyramid::level(const TextureRef& ref, float uvWidth) const {
  return levels_[static_cast<std::size_t>(exactLevel(ref, uvWidth) + 0.5f)];
}

Vec4 TexturePyramid::sample(const TextureRef& ref, Vec2 uv, float uvWidth) const {
  const float level = exactLevel(ref, uvWidth);
  const auto low = static_cast<std::size_t>(level);
  const float between = level - static_cast<float>(low);
  const Vec4 finer = levels_[low].sample(ref, uv);
  return between > 0.0f ? glm::mix(finer, levels_[low + 1].sample(ref, uv), between) : finer;
}

}  // namespace lumel
