// A glTF file taken apart: container, JSON (through tinygltf), buffers and compressed buffer views.
// Private to scene/gltf_*.cpp, which together are the one door to tinygltf.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

// Only the JSON reading of tinygltf is used: buffers, images and files are ours (size checks, path policy).
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS
#include <tiny_gltf.h>

#include "scene/base/expected.h"
#include "scene/files/load_options.h"

namespace lumel {

struct GltfBuffer {
  std::vector<std::uint8_t> owned;
  std::span<const std::uint8_t> bytes;  // into `owned` or the container
  bool present = false;                 // false: neither uri nor GLB chunk (fallback buffers of meshopt), or no file
  std::string problem;                  // an error once something reads what is not there; else a warning
};

struct GltfImage {
  std::string name;
  std::string uri;
  std::string mimeType;
  int bufferView = -1;
};

/// All indices inside `model` are valid (checkGltfSchema); its own buffers and images are empty.
struct GltfDocument {
  std::string name;              // the file, for messages
  std::filesystem::path folder;  // that relative references start from
  LoadOptions options;
  tinygltf::Model model;
  std::vector<std::uint8_t> container;  // the file's bytes; a GLB's BIN chunk is read in place
  std::vector<GltfBuffer> buffers;
  std::vector<GltfImage> images;
  std::vector<std::string> warnings;
  std::vector<std::vector<std::uint8_t>> decodedViews;  // per buffer view; empty unless meshopt-compressed

  GltfDocument() = default;
  GltfDocument(GltfDocument&&) = default;
  GltfDocument& operator=(GltfDocument&&) = default;

  /// "level.gltf: accessors/3: problem".
  Error error(const std::string& place, const std::string& problem) const {
    return inputError(name + ": " + place + ": " + problem);
  }

  /// The (decompressed) bytes of a buffer view, inside its buffer.
  Expected<std::span<const std::uint8_t>> viewBytes(int view) const;
};

/// Reads the container, checks version, required extensions and schema, loads the buffers and decompresses
/// meshopt views. `bytes` is the whole .gltf or .glb (told apart by content).
Expected<GltfDocument> openGltf(std::vector<std::uint8_t> bytes, const std::string& name,
                                const std::filesystem::path& folder, const LoadOptions& options);

/// Reads JSON that stands in a text; nothing where it is none, or nests too deep.
std::optional<tinygltf::Value> valueOfJson(const std::string& text);

/// The member `key` of a tinygltf extension value as a number or index, or the fallback.
double valueNumber(const tinygltf::Value& object, const char* key, double fallback);

inline const tinygltf::Value* findExtension(const tinygltf::ExtensionMap& extensions, const char* name) {
  const auto it = extensions.find(name);
  return it == extensions.end() ? nullptr : &it->second;
}

}  // namespace lumel
