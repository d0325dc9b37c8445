// Entry points for fuzzing the loaders: any bytes must give a scene or an error. The replay test calls them with
// damaged files; with -DLUMEL_LIBFUZZER they build as libFuzzer targets too (scene_fuzz.cpp).
#pragma once

#include <cstdint>
#include <span>

namespace lumel {

/// Both return whether the bytes loaded. They abort (LUMEL_CHECK) if a loaded scene is not sound.
bool fuzzLoadGltf(std::span<const std::uint8_t> bytes);
bool fuzzLoadObj(std::span<const std::uint8_t> bytes);

}  // namespace lumel
