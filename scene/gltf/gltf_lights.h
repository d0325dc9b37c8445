// Lamps of a glTF node: KHR_lights_punctual, and extras.lumel.light for what that does not know. Private to scene/gltf.
#pragma once

#include <optional>

#include "scene/gltf/gltf_document.h"
#include "scene/gltf/light_units.h"
#include "scene/scene.h"

namespace lumel {

/// Appends the lamp of a node to `scene`, if it has one: that of KHR_lights_punctual with what extras.lumel.light of
/// the light and then of the node change of it, or one of the kinds that extras.lumel.light alone makes (README).
/// Errors: a setting that is not known, out of range or of another kind of light; an IES file that cannot be read.
std::optional<Error> addLight(const GltfDocument& document, std::size_t node, const glm::dmat4& worldFromNode,
                              const LightScale& scale, Scene& scene);

/// Tells whether an empty node stands where a modelling tool had an area light, which glTF does not have: it holds
/// nothing, and its name or its custom properties say so.
bool looksLikeAreaLight(const tinygltf::Node& node);

}  // namespace lumel
