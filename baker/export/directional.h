// Directional maps in world space, for engines that keep no tangent frame beside a lightmap.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "baker/files/read/baked_scene.h"
#include "lightmap/formats/chart_mips.h"

namespace lumel {

/// Two bands of light at a texel: irradiance / pi on a normal n is L0 + n.c.
struct BandMaps {
  std::array<Image, 4> maps;  // L0 and c along t, b, n of the bake frame
};

/// The bands of a page as the bake holds them: sh1 maps, or rnm maps of raw projection with the flat one
/// (lightmap/maps/rnm_to_sh.h); nothing where it has neither.
std::optional<BandMaps> bandsOf(const BakedScene& baked, std::size_t page);
/// Which of the bake's encodings bandsOf can read; empty: none.
std::string bandEncoding(const nlohmann::ordered_json& bakeJson, const std::string& file);

/// Four layers as Godot's directional lightmaps have them: L0, then for world y, z and x of c: c / (8 L0) + 1/2, from 0
/// to 1. Its shader decodes L0 + 8 L0 sum (layer - 1/2) n. c is limited to 4 L0 in each coordinate.
std::array<Image, 4> godotLayers(const BandMaps& bands, const BakedScene& baked, std::size_t page,
                                 const ChartTexels& texels);

/// Unity's directional map: RGB the mean direction of light d in Unity's world (glTF's with x negated) as d / 2 + 1/2,
/// alpha what d has along the surface's normal, likewise. Its shader decodes flat * (n.(RGB - 1/2) + 1/2) / alpha.
Image unityDirections(const BandMaps& bands, const BakedScene& baked, std::size_t page, const ChartTexels& texels);

}  // namespace lumel
