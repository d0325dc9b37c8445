// KTX2 and DDS files: a texture with its mip levels.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "lightmap/formats/texel_format.h"

namespace lumel {

struct GpuTexture {
  TexelFormat format = TexelFormat::Half;
  int width = 0;
  int height = 0;
  int depth = 1;  // slices; more than 1: a 3D texture, with one level
  /// From the finest on, each half as wide and high, rounded down. The slices of a level follow each other.
  std::vector<std::vector<std::uint8_t>> levels;
  std::map<std::string, std::string> metadata;  // KTX2 keeps it as key and text; DDS has no place for it
};

/// A file's bytes. KTX 2.0 (Khronos, sections 3 and 4) with its Data Format Descriptor, orientation "rd" (u right, v
/// down), levels from the coarsest on.
std::vector<std::uint8_t> ktx2File(const GpuTexture& texture);
/// DDS with the header of Direct3D 10, which names formats by DXGI_FORMAT. Precondition: depth 1.
std::vector<std::uint8_t> ddsFile(const GpuTexture& texture);

}  // namespace lumel
