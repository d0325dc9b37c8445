// Pictures for people of what a still shows: numbers in colours beside their scale, and several stills on one sheet.
#pragma once

#include <string>
#include <vector>

#include "baker/stills/compositor.h"

namespace lumel {

/// Numbers from the first to the 99th percentile through a scale of colours (dark to bright in every print), with a
/// legend beneath: sRGB-encoded, kLabelHeight higher than the still. Where they are not known it is grey.
Image numberPicture(const Still& still, const std::string& unit);

struct Panel {
  std::string name;
  Image picture;  // sRGB-encoded
};

/// Panels from left to right and top to bottom, their names above them; about as many columns as rows.
Image sheetOf(const std::vector<Panel>& panels);

}  // namespace lumel
