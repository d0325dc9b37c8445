#include "scene/images/image_type.h"

#include <algorithm>
#include <string_view>

namespace lumel {

std::string imageMimeType(std::span<const std::uint8_t> encoded) {
  struct Kind {
    std::string_view magic;
    const char* mimeType;
  };
  using namespace std::string_view_literals;
  static constexpr Kind kKinds[] = {{"\x89PNG"sv, "image/png"},     {"\xFF\xD8\xFF"sv, "image/jpeg"},
                                    {"DDS "sv, "image/vnd-ms.dds"}, {"\x76\x2F\x31\x01"sv, "image/x-exr"},
                                    {"#?"sv, "image/vnd.radiance"}, {"GIF8"sv, "image/gif"},
                                    {"II*\0"sv, "image/tiff"},      {"MM\0*"sv, "image/tiff"},
                                    {"BM"sv, "image/bmp"}};
  const std::string_view bytes(reinterpret_cast<const char*>(encoded.data()), encoded.size());
  if (bytes.substr(0, 4) == "RIFF" && bytes.size() >= 12 && bytes.substr(8, 4) == "WEBP") return "image/webp";
  for (const Kind& kind : kKinds)
    if (bytes.substr(0, kind.magic.size()) == kind.magic) return kind.mimeType;
  return "";
}

}  // namespace lumel
