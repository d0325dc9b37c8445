#include "baker/stills/sheet.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "baker/stills/label.h"

namespace lumel {
namespace {

constexpr int kGap = 6;
constexpr Vec3 kPaper(0.12f);
constexpr Vec3 kInk(0.9f);
constexpr Vec3 kUnknown(0.4f);

/// From dark violet over green to yellow, evenly brighter: between these, in sRGB.
Vec3 scaleColor(float share) {
  static constexpr Vec3 kStops[] = {{0.25f, 0.05f, 0.35f}, {0.22f, 0.28f, 0.55f}, {0.13f, 0.48f, 0.56f},
                                    {0.12f, 0.65f, 0.49f}, {0.48f, 0.80f, 0.30f}, {0.98f, 0.90f, 0.20f}};
  constexpr int kLast = static_cast<int>(std::size(kStops)) - 1;
  const float at = std::clamp(share, 0.0f, 1.0f) * static_cast<float>(kLast);
  const int below = std::min(static_cast<int>(at), kLast - 1);
  return glm::mix(kStops[below], kStops[below + 1], at - static_cast<float>(below));
}

std::string textOf(float number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", static_cast<double>(number));
  return text;
}

void copyInto(Image& sheet, const Image& picture, int x0, int y0) {
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) sheet.setRgb(x0 + x, y0 + y, picture.rgb(x, y));
}

Image paper(int width, int height) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.setRgb(x, y, kPaper);
  return image;
}

void drawLegend(Image& image, int y0, float least, float most, const std::string& unit) {
  const std::string low = textOf(least), high = textOf(most) + " " + unit;
  const int left = kGap + labelWidth(low) + kGap, right = image.width - kGap - labelWidth(high) - kGap;
  drawLabel(image, kGap, y0, low, kInk);
  for (int x = left; x < right; ++x)
    for (int y = 4; y < kLabelHeight - 4; ++y)
      image.setRgb(x, y0 + y, scaleColor(static_cast<float>(x - left) / static_cast<float>(right - left)));
  drawLabel(image, std::max(right + kGap, left), y0, high, kInk);
}

}  // namespace

Image numberPicture(const Still& still, const std::string& unit) {
  constexpr float kKnown = 1e-3f;
  std::vector<float> values;
  const int width = still.radiance.width, height = still.radiance.height;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (still.lit.at(x, y)[0] > kKnown) values.push_back(still.radiance.at(x, y)[0]);
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values.empty() ? 0.0f : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  const float least = at(0.01), most = at(0.99);
  const float span = most > least ? most - least : 1.0f;
  Image image = paper(width, height + kLabelHeight);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.setRgb(x, y,
                   still.lit.at(x, y)[0] > kKnown ? scaleColor((still.radiance.at(x, y)[0] - least) / span) : kUnknown);
  drawLegend(image, height, least, most, unit);
  return image;
}

Image sheetOf(const std::vector<Panel>& panels) {
  if (panels.empty()) return {};
  int width = 0, height = 0;
  for (const Panel& panel : panels) {
    width = std::max(width, panel.picture.width);
    height = std::max(height, panel.picture.height);
  }
  const auto count = static_cast<int>(panels.size());
  const int columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
  const int rows = (count + columns - 1) / columns;
  const int stepX = width + kGap, stepY = height + kLabelHeight + kGap;
  Image sheet = paper(columns * stepX + kGap, rows * stepY + kGap);
  for (int i = 0; i < count; ++i) {
    const Panel& panel = panels[static_cast<std::size_t>(i)];
    const int x = kGap + i % columns * stepX, y = kGap + i / columns * stepY;
    drawLabel(sheet, x, y, panel.name, kInk);
    copyInto(sheet, panel.picture, x, y + kLabelHeight);
  }
  return sheet;
}

}  // namespace lumel
