// Short texts in pictures: names of panels, ends of scales.
#pragma once

#include <string_view>

#include "scene/image.h"

namespace lumel {

/// Height of a line of text in pixels, with the space around it.
inline constexpr int kLabelHeight = 21;

/// Width in pixels of what drawLabel draws.
int labelWidth(std::string_view text);

/// Draws letters (as capitals), digits and -._%/+:=() from (x, y) on, the top left corner of the line; other characters
/// are left free, and what lies outside of the image is cut.
void drawLabel(Image& image, int x, int y, std::string_view text, const Vec3& color);

}  // namespace lumel
