#include "scene/gltf/gltf_meshopt.h"

#include <meshoptimizer.h>

#include <string>

#include "scene/gltf/gltf_document.h"

namespace lumel {
namespace {

struct CompressedView {
  std::span<const std::uint8_t> bytes;
  std::size_t count = 0;
  std::size_t stride = 0;
  std::string mode;
  std::string filter;
};

// Both codecs spend at least 2 bits per 16 bytes (vertices) or a byte per triangle, so a count far beyond that is
// a lie; the test keeps a small file from asking for terabytes.
constexpr std::size_t kMaxExpansion = 128;

Expected<CompressedView> describe(const GltfDocument& document, const tinygltf::Value& extension,
                                  const std::string& place) {
  CompressedView view;
  const auto size = [&](const char* key) { return static_cast<std::size_t>(valueNumber(extension, key, 0)); };
  const auto& buffer = document.buffers[size("buffer")];
  const std::size_t offset = size("byteOffset");
  const std::size_t length = size("byteLength");
  view.count = size("count");
  view.stride = size("byteStride");
  view.mode = extension.Get("mode").Get<std::string>();
  if (extension.Has("filter")) view.filter = extension.Get("filter").Get<std::string>();
  if (!buffer.present || offset > buffer.bytes.size() || length > buffer.bytes.size() - offset)
    return document.error(place, "its compressed bytes lie outside their buffer; export or copy the file again");
  view.bytes = buffer.bytes.subspan(offset, length);
  const bool attributes = view.mode == "ATTRIBUTES";
  if (attributes ? (view.stride == 0 || view.stride > 256 || view.stride % 4 != 0)
                 : (view.stride != 2 && view.stride != 4))
    return document.error(place, "byteStride " + std::to_string(view.stride) + " does not fit mode " + view.mode);
  if (view.count > (view.bytes.size() + 1) * kMaxExpansion)
    return document.error(place, "a count of " + std::to_string(view.count) + " cannot come from " +
                                     std::to_string(view.bytes.size()) + " bytes");
  return view;
}

Expected<void> applyFilter(const GltfDocument& document, const CompressedView& view, const std::string& place,
                           std::uint8_t* data) {
  if (view.filter.empty() || view.filter == "NONE") return {};
  if (view.filter == "OCTAHEDRAL" && (view.stride == 4 || view.stride == 8))
    meshopt_decodeFilterOct(data, view.count, view.stride);
  else if (view.filter == "QUATERNION" && view.stride == 8)
    meshopt_decodeFilterQuat(data, view.count, view.stride);
  else if (view.filter == "EXPONENTIAL")
    meshopt_decodeFilterExp(data, view.count, view.stride);
  else
    return document.error(place, "filter '" + view.filter + "' with byteStride " + std::to_string(view.stride) +
                                     " is not supported; export without that filter");
  return {};
}

Expected<std::vector<std::uint8_t>> decode(const GltfDocument& document, const CompressedView& view,
                                           const std::string& place) {
  std::vector<std::uint8_t> data(view.count * view.stride);
  int failed = 1;
  if (view.mode == "ATTRIBUTES")
    failed = meshopt_decodeVertexBuffer(data.data(), view.count, view.stride, view.bytes.data(), view.bytes.size());
  else if (view.mode == "TRIANGLES" && view.count % 3 == 0)
    failed = meshopt_decodeIndexBuffer(data.data(), view.count, view.stride, view.bytes.data(), view.bytes.size());
  else if (view.mode == "INDICES")
    failed = meshopt_decodeIndexSequence(data.data(), view.count, view.stride, view.bytes.data(), view.bytes.size());
  if (failed != 0)
    return document.error(place, "its compressed bytes cannot be decoded (mode " + view.mode +
                                     "); export again, with version 0 of the vertex codec");
  if (view.mode == "ATTRIBUTES") {
    auto filtered = applyFilter(document, view, place, data.data());
    if (!filtered) return filtered.error();
  }
  return data;
}

}  // namespace

Expected<void> decodeMeshoptViews(GltfDocument& document) {
  for (std::size_t i = 0; i < document.model.bufferViews.size(); ++i) {
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
      const auto* extension = findExtension(document.model.bufferViews[i].extensions, name);
      if (!extension || !document.decodedViews[i].empty()) continue;
      const std::string place = "bufferViews/" + std::to_string(i) + "/extensions/" + name;
      auto view = describe(document, *extension, place);
      if (!view) return view.error();
      auto bytes = decode(document, *view, place);
      if (!bytes) return bytes.error();
      document.decodedViews[i] = *std::move(bytes);
    }
  }
  return {};
}

}  // namespace lumel
