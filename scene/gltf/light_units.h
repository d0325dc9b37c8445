// The unit that the lamps of a glTF file are in. glTF says candela and lux; Blender's exporter writes what its user
// gave in watts in one of three ways and does not say in which. Private to scene/gltf.
#pragma once

#include <string>
#include <vector>

#include "scene/gltf/gltf_document.h"

namespace lumel {

/// Factors from the numbers of a file to Lumel's, in which a lamp and a shining surface of equal power light alike.
struct LightScale {
  double candela = 1.0;  // of points and spots
  double lux = 1.0;      // of directional lights
  double lumens = 1.0;   // of lights that extras.lumel.light gives in lumens
};

/// Returns the factors for a file. Auto recognises Blender's exporter by asset.generator. From 3.4 on it writes 683
/// times the watts by default ("Standard": P 683 / 4 pi candela of points and spots, 683 E lux of suns), before it
/// wrote the watts themselves. The other ways ("Unitless" without the 683, "Raw") are taken where the powers of all
/// lamps are numbers of at most four digits in them, as people give them, and are not in the default. What was taken
/// for granted is added to `notes`, with how to overrule it.
LightScale lightScaleOf(const GltfDocument& document, std::vector<std::string>& notes);

}  // namespace lumel
