#include "scene/images/environment.h"

#include <algorithm>
#include <cmath>

#include "scene/images/image_io.h"

namespace lumel {

Expected<Environment> loadEnvironment(const std::filesystem::path& file) {
  auto loaded = readImage(file);
  if (!loaded) return loaded.error();
  if (!loaded->isFloat)
    return inputError(file.string() + ": holds integers (" + loaded->format +
                      "), not radiance; use an .hdr or .exr file");
  const Image& in = loaded->image;
  Environment environment;
  environment.image = Image(in.width, in.height, 3);
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x) {
      const float* p = in.at(x, y);
      const Vec3 radiance = in.channels >= 3 ? Vec3(p[0], p[1], p[2]) : Vec3(p[0]);
      for (int c = 0; c < 3; ++c)
        if (!std::isfinite(radiance[c]) || radiance[c] < 0)
          return inputError(file.string() + ": pixel (" + std::to_string(x) + ", " + std::to_string(y) + ") is " +
                            std::to_string(radiance[c]) +
                            "; radiance must be finite and not negative: repair the image");
      environment.image.setRgb(x, y, radiance);
    }
  return environment;
}

Vec3 environmentRadiance(const Environment& environment, const Vec3& d) {
  if (environment.image.empty()) return environment.strength * environment.color;
  const Image& image = environment.image;
  // A sky turned counter-clockwise (towards smaller atan2(z, x)) is read further on in u.
  const float u = 0.5f + std::atan2(d.z, d.x) * 0.5f * kInvPi + environment.rotationDegrees / 360.0f;
  const float v = 0.5f - std::asin(std::clamp(d.y, -1.0f, 1.0f)) * kInvPi;
  const float x = (u - std::floor(u)) * static_cast<float>(image.width) - 0.5f;
  const float y = v * static_cast<float>(image.height) - 0.5f;
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  const auto texel = [&](int i, int j) {
    return image.rgb((i + image.width) % image.width, std::clamp(j, 0, image.height - 1));
  };
  const float fx = x - static_cast<float>(left), fy = y - static_cast<float>(top);
  return environment.strength * glm::mix(glm::mix(texel(left, top), texel(left + 1, top), fx),
                                         glm::mix(texel(left, top + 1), texel(left + 1, top + 1), fx), fy);
}

}  // namespace lumel
