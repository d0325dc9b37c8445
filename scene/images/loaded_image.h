// An image file's contents before anything is made of them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "scene/image.h"

namespace lumel {

/// An image as stored in its file, without colour conversion; integers are scaled to 0..1.
struct LoadedImage {
  Image image;                                  // all channels of the file's first subimage, in file order
  std::vector<std::string> channelNames;        // one per channel, e.g. "R", "G", "B", "A"
  std::map<std::string, std::string> metadata;  // string, int and float attributes, as text
  std::string format;                           // OpenImageIO's name: "png", "openexr", "jpeg", ...
  int bitsPerChannel = 0;                       // 8, 16 or 32
  bool isFloat = false;                         // half or float in the file
  bool paletted = false;                        // indexed colours (expanded in `image`)
  std::vector<std::uint8_t> bytes;              // in place of image.pixels, see PixelsAs::Stored
};

}  // namespace lumel
