#include "lightmap/formats/texture_files.h"

#include <algorithm>
#include <array>
#include <bit>
#include <span>

#include "scene/base/check.h"
#include "scene/images/dds_file.h"

namespace lumel {
namespace {

/// Bytes under construction, little-endian.
class Bytes {
 public:
  void put(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) data.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  }
  void word(std::uint32_t value) { put(value, 4); }
  void wordAt(std::size_t at, std::uint64_t value, int bytes = 4) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(bytes); ++i)
      data[at + i] = static_cast<std::uint8_t>(value >> 8 * i);
  }
  void align(std::size_t to) { data.resize((data.size() + to - 1) / to * to, 0); }
  void append(std::span<const std::uint8_t> more) { data.insert(data.end(), more.begin(), more.end()); }

  std::vector<std::uint8_t> data;
};

/// One sample of a data format descriptor (Khronos Data Format 1.3, 5.14).
struct Sample {
  std::uint32_t bitOffset, bitLength, channel, qualifiers, lower, upper;
};
constexpr std::uint32_t kExponent = 0x2, kSigned = 0x4, kFloat = 0x8;
constexpr std::uint32_t kAlphaChannel = 15;

std::vector<Sample> samplesOf(TexelFormat format) {
  const auto one = std::bit_cast<std::uint32_t>(1.0f), minusOne = std::bit_cast<std::uint32_t>(-1.0f);
  switch (format) {
    case TexelFormat::Half: {
      std::vector<Sample> samples;
      for (std::uint32_t c = 0; c < 4; ++c)
        samples.push_back({16 * c, 16, c < 3 ? c : kAlphaChannel, kSigned | kFloat, minusOne, one});
      return samples;
    }
    case TexelFormat::Rgb9e5: {
      // Mantissas in units of 1 / 8448 ..., exponents with their bias, as the specification's example has them.
      std::vector<Sample> samples;
      for (std::uint32_t c = 0; c < 3; ++c) {
        samples.push_back({9 * c, 9, c, 0, 0, 8448});
        samples.push_back({27, 5, c, kExponent, 15, 31});
      }
      return samples;
    }
    case TexelFormat::Bc6h:
      return {{0, 128, 0, kFloat, 0, one}};
    case TexelFormat::Bc6hSigned:
      return {{0, 128, 0, kSigned | kFloat, minusOne, one}};
  }
  return {};
}

/// Basic data format descriptor: colour model, Rec. 709 primaries, linear.
void putDescriptor(Bytes& out, TexelFormat format) {
  constexpr std::uint32_t kRgbsda = 1, kBc6hModel = 133, kBt709 = 1, kLinear = 1, kVersion = 2;
  const std::vector<Sample> samples = samplesOf(format);
  const TexelFormatTraits& traits = traitsOf(format);
  const auto blockSize = static_cast<std::uint32_t>(24 + 16 * samples.size());
  const std::uint32_t model = traits.blockSide > 1 ? kBc6hModel : kRgbsda;
  const auto side = static_cast<std::uint32_t>(traits.blockSide - 1);
  out.word(blockSize + 4);
  out.word(0);  // vendor Khronos, type basic
  out.word(kVersion | blockSize << 16);
  out.word(model | kBt709 << 8 | kLinear << 16);
  out.word(side | side << 8);
  out.word(static_cast<std::uint32_t>(traits.blockBytes));
  out.word(0);
  for (const Sample& s : samples) {
    out.word(s.bitOffset | (s.bitLength - 1) << 16 | (s.channel | s.qualifiers << 4) << 24);
    out.word(0);  // position
    out.word(s.lower);
    out.word(s.upper);
  }
}

/// Keys in the order of their bytes, each entry padded to four.
void putKeyValues(Bytes& out, const std::map<std::string, std::string>& metadata) {
  for (const auto& [key, text] : metadata) {
    out.word(static_cast<std::uint32_t>(key.size() + text.size() + 2));
    for (const std::string& part : {key, text}) {
      out.append(std::span(reinterpret_cast<const std::uint8_t*>(part.data()), part.size()));
      out.put(0, 1);
    }
    out.align(4);
  }
}

}  // namespace

std::vector<std::uint8_t> ktx2File(const GpuTexture& texture) {
  constexpr std::array<std::uint8_t, 12> kIdentifier = {0xAB, 'K',  'T',  'X',  ' ',  '2',
                                                        '0',  0xBB, '\r', '\n', 0x1A, '\n'};
  const TexelFormatTraits& traits = traitsOf(texture.format);
  const bool is3d = texture.depth > 1;
  Bytes out;
  out.append(kIdentifier);
  out.word(static_cast<std::uint32_t>(traits.vkFormat));
  // The size of what a big-endian machine would swap: halves, whole words; blocks are bytes.
  out.word(texture.format == TexelFormat::Half ? 2 : texture.format == TexelFormat::Rgb9e5 ? 4 : 1);
  out.word(static_cast<std::uint32_t>(texture.width));
  out.word(static_cast<std::uint32_t>(texture.height));
  out.word(is3d ? static_cast<std::uint32_t>(texture.depth) : 0);
  out.word(0);  // not an array
  out.word(1);  // not a cube
  out.word(static_cast<std::uint32_t>(texture.levels.size()));
  out.word(0);  // not compressed once more
  const std::size_t index = out.data.size();
  out.data.resize(index + 32 + 24 * texture.levels.size(), 0);
  const std::size_t descriptor = out.data.size();
  putDescriptor(out, texture.format);
  const std::size_t keys = out.data.size();
  std::map<std::string, std::string> metadata = texture.metadata;
  metadata["KTXorientation"] = is3d ? "rdi" : "rd";
  putKeyValues(out, metadata);
  out.wordAt(index, descriptor);
  out.wordAt(index + 4, keys - descriptor);
  out.wordAt(index + 8, keys);
  out.wordAt(index + 12, out.data.size() - keys);
  for (std::size_t level = texture.levels.size(); level-- > 0;) {
    out.align(std::max<std::size_t>(traits.blockBytes, 4));
    const std::size_t entry = index + 32 + 24 * level;
    const std::size_t size = texture.levels[level].size();
    out.wordAt(entry, out.data.size(), 8);
    out.wordAt(entry + 8, size, 8);
    out.wordAt(entry + 16, size, 8);
    out.append(texture.levels[level]);
  }
  return std::move(out.data);
}

std::vector<std::uint8_t> ddsFile(const GpuTexture& texture) {
  LUMEL_CHECK(texture.depth == 1);
  const TexelFormatTraits& traits = traitsOf(texture.format);
  const bool isBlocks = traits.blockSide > 1;
  std::vector<std::uint8_t> file =
      ddsHeaderBytes({.width = texture.width,
                      .height = texture.height,
                      .levels = texture.levels.size(),
                      .isBlocks = isBlocks,
                      .firstBytes = byteCount(texture.format, texture.width, isBlocks ? texture.height : 1),
                      .dxgiFormat = static_cast<std::uint32_t>(traits.dxgiFormat)});
  for (const std::vector<std::uint8_t>& level : texture.levels) file.insert(file.end(), level.begin(), level.end());
  return file;
}

}  // namespace lumel
