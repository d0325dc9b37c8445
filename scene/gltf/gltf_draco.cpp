#include "scene/gltf/gltf_draco.h"

#include <draco/compression/decode.h>
#include <draco/core/decoder_buffer.h>
#include <draco/mesh/mesh.h>

#include <exception>
#include <memory>

namespace lumel {
namespace {

template <class T>
bool readValue(const draco::PointAttribute& attribute, draco::AttributeValueIndex index, float* out) {
  T values[4] = {};
  if (attribute.num_components() > 4) return false;
  attribute.GetValue(index, values);
  for (int c = 0; c < attribute.num_components(); ++c) out[c] = static_cast<float>(values[c]);
  return true;
}

bool readAny(const draco::PointAttribute& attribute, draco::AttributeValueIndex index, float* out) {
  switch (attribute.data_type()) {
    case draco::DT_INT8:
      return readValue<std::int8_t>(attribute, index, out);
    case draco::DT_UINT8:
      return readValue<std::uint8_t>(attribute, index, out);
    case draco::DT_INT16:
      return readValue<std::int16_t>(attribute, index, out);
    case draco::DT_UINT16:
      return readValue<std::uint16_t>(attribute, index, out);
    case draco::DT_UINT32:
      return readValue<std::uint32_t>(attribute, index, out);
    case draco::DT_FLOAT32:
      return readValue<float>(attribute, index, out);
    default:
      return false;
  }
}

Expected<DracoAttribute> readAttribute(const draco::Mesh& mesh, int id, const std::string& name) {
  const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(id));
  if (!attribute) return inputError("has no Draco attribute " + std::to_string(id) + " for " + name);
  DracoAttribute result;
  result.components = attribute->num_components();
  result.values.resize(static_cast<std::size_t>(result.components) * mesh.num_points());
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
    const draco::AttributeValueIndex value = attribute->mapped_index(point);
    const bool inRange =
        value.value() < attribute->size() && static_cast<std::int64_t>(value.value() + 1) * attribute->byte_stride() <=
                                                 static_cast<std::int64_t>(attribute->buffer()->data_size());
    if (!inRange ||
        !readAny(*attribute, value, &result.values[point.value() * static_cast<std::size_t>(result.components)]))
      return inputError("Draco attribute " + name + " cannot be read");
  }
  return result;
}

Expected<DracoMesh> decodeMesh(std::span<const std::uint8_t> bytes, const std::map<std::string, int>& attributeIds) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) return inputError("Draco data cannot be decoded: " + decoded.status().error_msg_string());
  const std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
  DracoMesh result;
  result.vertexCount = mesh->num_points();
  result.indices.reserve(std::size_t{mesh->num_faces()} * 3);
  for (draco::FaceIndex f(0); f < mesh->num_faces(); ++f)
    for (const draco::PointIndex& point : mesh->face(f)) {
      if (point.value() >= result.vertexCount) return inputError("Draco data refers to a vertex that does not exist");
      result.indices.push_back(point.value());
    }
  for (const auto& [name, id] : attributeIds) {
    auto attribute = readAttribute(*mesh, id, name);
    if (!attribute) return attribute.error();
    result.attributes[name] = *std::move(attribute);
  }
  return result;
}

}  // namespace

Expected<DracoMesh> decodeDraco(std::span<const std::uint8_t> bytes, const std::map<std::string, int>& attributeIds) {
  try {
    return decodeMesh(bytes, attributeIds);
  } catch (const std::exception& e) {
    return inputError(std::string("Draco data cannot be decoded: ") + e.what());
  }
}

}  // namespace lumel
