#include "scene/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/image_io.h"

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

/// Texel index for a coordinate that may lie outside the image.
int wrapTexel(std::int64_t i, int size, Wrap mode) {
  const std::int64_t n = size;
  switch (mode) {
    case Wrap::Clamp:
      return static_cast<int>(std::clamp<std::int64_t>(i, 0, n - 1));
    case Wrap::Mirror: {
      const std::int64_t m = ((i % (2 * n)) + 2 * n) % (2 * n);
      return static_cast<int>(m < n ? m : 2 * n - 1 - m);
    }
    default:
      return static_cast<int>(((i % n) + n) % n);
  }
}

/// Far from the origin a float UV no longer tells texels apart; limits keep the integer arithmetic defined.
float tameCoordinate(float uv) { return std::isfinite(uv) ? std::clamp(uv, -1e6f, 1e6f) : 0.0f; }

}  // namespace

Expected<Texture> Texture::decode(const ImageSource& source, ColorSpace space) {
  if (source.encoded.empty()) return inputError(source.name + ": the image is missing");
  auto loaded = readImage(source.encoded, source.name);
  if (!loaded) return loaded.error();
  const Image& image = loaded->image;
  Texture texture;
  texture.width_ = image.width;
  texture.height_ = image.height;
  texture.space_ = space;
  const bool bytes = loaded->bitsPerChannel <= 8;
  const std::size_t texels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  const auto channels = static_cast<std::size_t>(image.channels);
  if (bytes)
    texture.bytes_.resize(4 * texels);
  else
    texture.floats_.resize(4 * texels);
  for (std::size_t t = 0; t < texels; ++t) {
    const float* in = &image.pixels[t * channels];
    const bool grey = channels < 3;
    float rgba[4] = {in[0], grey ? in[0] : in[1], grey ? in[0] : in[2], 1.0f};
    if (channels == 2) rgba[3] = in[1];
    if (channels >= 4) rgba[3] = in[3];
    for (std::size_t c = 0; c < 4; ++c) {
      if (bytes)
        texture.bytes_[4 * t + c] = static_cast<std::uint8_t>(std::lround(std::clamp(rgba[c], 0.0f, 1.0f) * 255.0f));
      else
        // Float files (EXR, HDR) are linear already; 16-bit ones are encoded as 8-bit ones are.
        texture.floats_[4 * t + c] =
            space == ColorSpace::Srgb && c < 3 && !loaded->isFloat ? srgbToLinear(rgba[c]) : rgba[c];
    }
  }
  return texture;
}

Vec4 Texture::fetch(int x, int y) const {
  const std::size_t at =
      4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x));
  if (bytes_.empty()) return {floats_[at], floats_[at + 1], floats_[at + 2], floats_[at + 3]};
  const Table& table = tableOf(space_);
  return {table[bytes_[at]], table[bytes_[at + 1]], table[bytes_[at + 2]],
          static_cast<float>(bytes_[at + 3]) / 255.0f};
}

Vec4 Texture::sample(const TextureRef& ref, Vec2 uv) const {
  const Vec3 transformed = ref.uvMatrix * Vec3(uv, 1.0f);
  const float x = tameCoordinate(transformed.x) * static_cast<float>(width_);
  const float y = tameCoordinate(transformed.y) * static_cast<float>(height_);
  const auto texel = [&](std::int64_t i, std::int64_t j) {
    return fetch(wrapTexel(i, width_, ref.wrapU), wrapTexel(j, height_, ref.wrapV));
  };
  if (ref.nearest) return texel(static_cast<std::int64_t>(std::floor(x)), static_cast<std::int64_t>(std::floor(y)));
  const float left = std::floor(x - 0.5f), top = std::floor(y - 0.5f);
  const float fx = x - 0.5f - left, fy = y - 0.5f - top;
  const auto i = static_cast<std::int64_t>(left), j = static_cast<std::int64_t>(top);
  return glm::mix(glm::mix(texel(i, j), texel(i + 1, j), fx), glm::mix(texel(i, j + 1), texel(i + 1, j + 1), fx), fy);
}

void Texture::prefetch(const TextureRef& ref, Vec2 uv) const {
  const Vec3 transformed = ref.uvMatrix * Vec3(uv, 1.0f);
  const float x = tameCoordinate(transformed.x) * static_cast<float>(width_) - 0.5f;
  const float y = tameCoordinate(transformed.y) * static_cast<float>(height_) - 0.5f;
  const int column = wrapTexel(static_cast<std::int64_t>(std::floor(x)), width_, ref.wrapU);
  const auto top = static_cast<std::int64_t>(std::floor(y));
  // Of the footprint's two rows, the left texels: the right ones mostly share their cache lines.
  for (const std::int64_t row : {top, top + 1}) {
    const std::size_t at = 4 * (static_cast<std::size_t>(wrapTexel(row, height_, ref.wrapV)) *
                                    static_cast<std::size_t>(width_) +
                                static_cast<std::size_t>(column));
    if (bytes_.empty())
      __builtin_prefetch(&floats_[at]);
    else
      __builtin_prefetch(&bytes_[at]);
  }
}

}  // namespace lumel
