// Decoded textures and their lookup, shared by the bake and the compositor.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

enum class ColorSpace { Linear, Srgb };

/// An image ready for lookup: 8-bit sources stay 8 bits, others become float. Missing channels read as in glTF
/// (grey replicates, alpha 1).
class Texture {
 public:
  /// `space` says how the colour channels (never alpha) are decoded to linear.
  static Expected<Texture> decode(const ImageSource& source, ColorSpace space);

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t bytes() const { return bytes_.size() + alphaBytes_.size() + floats_.size() * sizeof(float); }
  /// Whether alpha is 1 everywhere.
  bool opaque() const { return opaque_; }

  /// Linear RGBA of texel (x, y), rows from the top; coordinates must be in range.
  Vec4 fetch(int x, int y) const;
  /// What a lookup reads: four texels, and how far between them.
  struct Footprint {
    int columns[2];
    int rows[2];
    float fx = 0.0f;
    float fy = 0.0f;
  };
  /// Returns the texels that a bilinear lookup (or nearest, as ref says) with wrap modes reads at ref.uvMatrix * uv,
  /// and their weights. Texel centres lie at (i + 0.5) / size.
  Footprint footprint(const TextureRef& ref, Vec2 uv) const;
  Vec4 sample(const Footprint& at) const;
  Vec4 sample(const TextureRef& ref, Vec2 uv) const { return sample(footprint(ref, uv)); }
  /// The fourth component of sample() alone.
  float sampleAlpha(const TextureRef& ref, Vec2 uv) const;
  /// The next level of a mip chain: half as wide and high (at least 1), each texel the mean, of linear values, of what
  /// it covers. An 8-bit image stays one.
  Texture halved() const;
  /// Asks the processor to bring the texels that sample() will read closer. No effect on any result.
  void prefetch(const Footprint& at) const;

 private:
  /// What a block of kBlock x kBlock texels holds, as bits: so small a table stays in a processor's cache, and most of
  /// what a cut-out is asked for lies in blocks of one kind.
  enum AlphaKind : std::uint8_t { kSomeTransparent = 1, kSomeVisible = 2 };
  static constexpr int kBlock = 8;

  float fetchAlpha(int x, int y) const;
  std::size_t texelAt(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  std::size_t blockOf(int x, int y) const {
    return static_cast<std::size_t>(y / kBlock) * static_cast<std::size_t>((width_ + kBlock - 1) / kBlock) +
           static_cast<std::size_t>(x / kBlock);
  }
  std::uint8_t& byteOf(std::size_t texel, std::size_t channel) {
    return channel < 3 ? bytes_[3 * texel + channel] : alphaBytes_[texel];
  }
  void set(int x, int y, const Vec4& rgba);
  void sortAlpha();

  int width_ = 0;
  int height_ = 0;
  ColorSpace space_ = ColorSpace::Linear;
  std::vector<std::uint8_t> bytes_;       // RGB
  std::vector<std::uint8_t> alphaBytes_;  // beside bytes_, unless opaque: cut-outs read nothing else
  std::vector<float> floats_;             // RGBA, linear
  bool opaque_ = false;
  std::vector<std::uint8_t> alphaBlocks_;  // AlphaKind; empty: not known, or all opaque
};

/// A texture and its mip chain (Williams 1983), for lookups where a texel is small in the picture.
class TexturePyramid {
 public:
  /// `coarser` false: sample() and level() know the finest alone.
  explicit TexturePyramid(Texture finest, bool coarser = true);

  const Texture& finest() const { return levels_.front(); }
  /// Mean about `uv` over roughly `uvWidth` on a side, in the units of `uv`, before ref.uvMatrix: between the two
  /// levels whose texels are about as wide. 0 is finest().sample().
  Vec4 sample(const TextureRef& ref, Vec2 uv, float uvWidth) const;
  /// The one of these two levels that is nearer.
  const Texture& level(const TextureRef& ref, float uvWidth) const;

 private:
  float exactLevel(const TextureRef& ref, float uvWidth) const;

  std::vector<Texture> levels_;  // the last is one texel
};

}  // namespace lumel
