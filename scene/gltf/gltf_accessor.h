// Typed arrays out of glTF accessors: strides, normalised and integer components, sparse overlays, bounds.
// Every byte range is checked before it is read or allocated for. Errors: Input, naming the accessor.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/base/math.h"
#include "scene/gltf/gltf_document.h"

namespace lumel {

/// Components of an accessor's type: 1 (SCALAR) to 4 (VEC4), 16 (MAT4).
int accessorComponents(const GltfDocument& document, int accessor);

/// Reads `components` floats per element into out, which has room for all of them. The accessor's type must have
/// just as many. Integers are converted, and scaled to 0..1 or -1..1 if normalised.
Expected<void> readFloats(const GltfDocument& document, int accessor, int components, float* out);

/// Checks that the accessor's elements can be read (so that its count can be trusted with an allocation).
Expected<void> checkAccessor(const GltfDocument& document, int accessor, int components);

/// An array of float, Vec2, Vec3, Vec4 or Mat4.
template <class T>
Expected<std::vector<T>> readArray(const GltfDocument& document, int accessor) {
  constexpr int components = static_cast<int>(sizeof(T) / sizeof(float));
  if (auto checked = checkAccessor(document, accessor, components); !checked) return checked.error();
  std::vector<T> values(document.model.accessors[static_cast<std::size_t>(accessor)].count);
  if (values.empty()) return values;
  auto read = readFloats(document, accessor, components, reinterpret_cast<float*>(values.data()));
  if (!read) return read.error();
  return values;
}

/// Unsigned integers (vertex or joint indices), `components` per element.
Expected<std::vector<std::uint32_t>> readIntegers(const GltfDocument& document, int accessor, int components = 1);

/// The number in 0..1 or -1..1 that a normalised integer stands for (glTF 2.0, section 3.6.2.2). Components that
/// cannot be normalised (32 bits) stay as they are.
float normalizedToFloat(float value, int componentType);

}  // namespace lumel
