#include "scene/gltf/gltf_accessor.h"

#include <algorithm>
#include <cstring>

namespace lumel {
namespace {

// Elements of an accessor without bytes of its own (all zero), which nothing else bounds.
constexpr std::size_t kMaxZeroElements = std::size_t{1} << 24;

struct ElementLayout {
  std::span<const std::uint8_t> bytes;  // from the first element; empty: all zero
  std::size_t stride = 0;
  std::size_t elementSize = 0;
  std::size_t componentSize = 0;
  int components = 0;
};

template <class T>
T load(const std::uint8_t* p) {
  T value;
  std::memcpy(&value, p, sizeof(T));
  return value;
}

std::size_t sizeOfComponent(int componentType) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    default:
      return 4;
  }
}

float componentToFloat(const std::uint8_t* p, int componentType) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return load<std::int8_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return load<std::uint8_t>(p);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return load<std::int16_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return static_cast<float>(load<std::uint32_t>(p));
    default:
      return load<float>(p);
  }
}

std::uint32_t componentToInteger(const std::uint8_t* p, int componentType) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return *p;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(p);
    default:
      return load<std::uint32_t>(p);
  }
}

std::string placeOf(int accessor) { return "accessors/" + std::to_string(accessor); }

/// Returns the bytes of a buffer view in which `count` elements of elementSize bytes lie.
Expected<std::span<const std::uint8_t>> elements(const GltfDocument& document, const std::string& place, int view,
                                                 std::size_t offset, std::size_t count, std::size_t stride,
                                                 std::size_t elementSize) {
  auto bytes = document.viewBytes(view);
  if (!bytes) return bytes.error();
  const std::size_t available = bytes->size();
  const bool fits = count == 0 || (offset <= available && elementSize <= available - offset &&
                                   (count - 1) <= (available - offset - elementSize) / stride);
  if (!fits)
    return document.error(place, std::to_string(count) + " elements from byte " + std::to_string(offset) +
                                     " on do not fit bufferViews/" + std::to_string(view) + ", which has " +
                                     std::to_string(available) + " bytes; export or copy the file again");
  return count == 0 ? bytes->first(0) : bytes->subspan(offset);
}

Expected<ElementLayout> layoutOf(const GltfDocument& document, int index, int components) {
  const auto& accessor = document.model.accessors[static_cast<std::size_t>(index)];
  ElementLayout layout;
  layout.components = accessorComponents(document, index);
  if (layout.components != components)
    return document.error(placeOf(index), "has " + std::to_string(layout.components) + " components where " +
                                              std::to_string(components) + " are needed");
  layout.componentSize = sizeOfComponent(accessor.componentType);
  if (components == 16 && layout.componentSize != 4)
    return document.error(placeOf(index), "a matrix here must be of floats");
  layout.elementSize = layout.componentSize * static_cast<std::size_t>(components);
  layout.stride = layout.elementSize;
  if (accessor.bufferView < 0) {
    if (accessor.count > kMaxZeroElements)
      return document.error(placeOf(index), std::to_string(accessor.count) + " elements without a bufferView");
    return layout;
  }
  const auto& view = document.model.bufferViews[static_cast<std::size_t>(accessor.bufferView)];
  if (view.byteStride != 0) layout.stride = view.byteStride;
  if (layout.stride < layout.elementSize)
    return document.error(placeOf(index), "byteStride " + std::to_string(layout.stride) +
                                              " is less than an element's " + std::to_string(layout.elementSize) +
                                              " bytes");
  auto bytes = elements(document, placeOf(index), accessor.bufferView, accessor.byteOffset, accessor.count,
                        layout.stride, layout.elementSize);
  if (!bytes) return bytes.error();
  layout.bytes = *bytes;
  return layout;
}

/// Calls write(element index, bytes) for each element that the sparse part replaces.
template <class Write>
Expected<void> applySparse(const GltfDocument& document, int index, const ElementLayout& layout, const Write& write) {
  const auto& accessor = document.model.accessors[static_cast<std::size_t>(index)];
  if (!accessor.sparse.isSparse) return {};
  const std::string place = placeOf(index) + "/sparse";
  const auto& sparse = accessor.sparse;
  const auto count = static_cast<std::size_t>(sparse.count);
  const int type = sparse.indices.componentType;
  if (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
      type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
    return document.error(place + "/indices", "componentType " + std::to_string(type) + " is not an unsigned integer");
  const std::size_t indexSize = sizeOfComponent(type);
  auto indices = elements(document, place + "/indices", sparse.indices.bufferView,
                          static_cast<std::size_t>(sparse.indices.byteOffset), count, indexSize, indexSize);
  if (!indices) return indices.error();
  auto values =
      elements(document, place + "/values", sparse.values.bufferView,
               static_cast<std::size_t>(sparse.values.byteOffset), count, layout.elementSize, layout.elementSize);
  if (!values) return values.error();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t element = componentToInteger(indices->data() + i * indexSize, type);
    if (element >= accessor.count)
      return document.error(place + "/indices", "entry " + std::to_string(i) + " is " + std::to_string(element) +
                                                    ", but the accessor has " + std::to_string(accessor.count) +
                                                    " elements");
    write(element, values->data() + i * layout.elementSize);
  }
  return {};
}

}  // namespace

float normalizedToFloat(float value, int componentType) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return std::max(value / 127.0f, -1.0f);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return value / 255.0f;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return std::max(value / 32767.0f, -1.0f);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return value / 65535.0f;
    default:
      return value;
  }
}

int accessorComponents(const GltfDocument& document, int accessor) {
  switch (document.model.accessors[static_cast<std::size_t>(accessor)].type) {
    case TINYGLTF_TYPE_SCALAR:
      return 1;
    case TINYGLTF_TYPE_VEC2:
      return 2;
    case TINYGLTF_TYPE_VEC3:
      return 3;
    case TINYGLTF_TYPE_VEC4:
    case TINYGLTF_TYPE_MAT2:
      return 4;
    case TINYGLTF_TYPE_MAT3:
      return 9;
    default:
      return 16;
  }
}

Expected<void> checkAccessor(const GltfDocument& document, int accessor, int components) {
  auto layout = layoutOf(document, accessor, components);
  if (!layout) return layout.error();
  return {};
}

Expected<void> readFloats(const GltfDocument& document, int index, int components, float* out) {
  auto layout = layoutOf(document, index, components);
  if (!layout) return layout.error();
  const auto& accessor = document.model.accessors[static_cast<std::size_t>(index)];
  const auto width = static_cast<std::size_t>(components);
  const auto write = [&](std::size_t element, const std::uint8_t* p) {
    if (accessor.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT) {
      std::memcpy(out + element * width, p, width * sizeof(float));
      return;
    }
    for (std::size_t c = 0; c < width; ++c) {
      const float value = componentToFloat(p + c * layout->componentSize, accessor.componentType);
      out[element * width + c] = accessor.normalized ? normalizedToFloat(value, accessor.componentType) : value;
    }
  };
  if (layout->bytes.empty()) {
    std::fill(out, out + accessor.count * width, 0.0f);
  } else {
    for (std::size_t i = 0; i < accessor.count; ++i) write(i, layout->bytes.data() + i * layout->stride);
  }
  return applySparse(document, index, *layout, write);
}

Expected<std::vector<std::uint32_t>> readIntegers(const GltfDocument& document, int index, int components) {
  auto layout = layoutOf(document, index, components);
  if (!layout) return layout.error();
  const auto& accessor = document.model.accessors[static_cast<std::size_t>(index)];
  const int type = accessor.componentType;
  if (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
      type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
    return document.error(placeOf(index), "componentType " + std::to_string(type) + " is not an unsigned integer");
  const auto width = static_cast<std::size_t>(components);
  std::vector<std::uint32_t> values(accessor.count * width, 0);
  const auto write = [&](std::size_t element, const std::uint8_t* p) {
    for (std::size_t c = 0; c < width; ++c)
      values[element * width + c] = componentToInteger(p + c * layout->componentSize, type);
  };
  if (!layout->bytes.empty())
    for (std::size_t i = 0; i < accessor.count; ++i) write(i, layout->bytes.data() + i * layout->stride);
  auto sparse = applySparse(document, index, *layout, write);
  if (!sparse) return sparse.error();
  return values;
}

}  // namespace lumel
