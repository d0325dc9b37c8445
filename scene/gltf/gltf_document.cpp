#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_INCLUDE_JSON
#include <fstream>  // tinygltf needs it, and leaves it out with TINYGLTF_NO_FS
#include <nlohmann/json.hpp>

#include "scene/gltf/gltf_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include "scene/files/file_access.h"
#include "scene/gltf/gltf_meshopt.h"
#include "scene/gltf/gltf_schema.h"

namespace lumel {
namespace {

using Json = nlohmann::json;

// Deeper than any real document (extras included), shallow enough for parsers that recurse.
constexpr int kMaxJsonDepth = 128;

constexpr std::array<std::string_view, 13> kHandledExtensions = {
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_texture_transform",
    "KHR_mesh_quantization",
    "KHR_materials_unlit",
    "EXT_texture_webp",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_draco_mesh_compression",
    "EXT_mesh_gpu_instancing",
    "KHR_materials_pbrSpecularGlossiness",  // its diffuse part, all a lightmap needs
    "KHR_materials_transmission",
    "KHR_texture_basisu",  // its fallback image, or none
};

struct Chunks {
  std::string_view json;
  std::optional<std::span<const std::uint8_t>> bin;
};

std::uint32_t littleEndian32(const std::uint8_t* p) {
  return std::uint32_t{p[0]} | std::uint32_t{p[1]} << 8 | std::uint32_t{p[2]} << 16 | std::uint32_t{p[3]} << 24;
}

Expected<Chunks> splitContainer(const std::vector<std::uint8_t>& bytes, const std::string& name) {
  const auto text = [&](std::size_t at, std::size_t length) {
    return std::string_view(reinterpret_cast<const char*>(bytes.data()) + at, length);
  };
  if (bytes.size() < 4 || text(0, 4) != "glTF") return Chunks{text(0, bytes.size()), std::nullopt};
  const auto truncated = [&](const std::string& what) {
    return inputError(name + ": GLB container: " + what + " is cut off at " + std::to_string(bytes.size()) +
                      " bytes; export or copy the file again");
  };
  if (bytes.size() < 20) return truncated("the header");
  if (const auto version = littleEndian32(&bytes[4]); version != 2)
    return inputError(name + ": GLB container: version " + std::to_string(version) +
                      " is not 2; convert the file to glTF 2.0");
  const std::size_t length = littleEndian32(&bytes[8]);
  if (length > bytes.size()) return truncated("a file of " + std::to_string(length) + " bytes");
  Chunks chunks;
  for (std::size_t at = 12; at + 8 <= length;) {
    const std::size_t size = littleEndian32(&bytes[at]);
    const std::string_view type = text(at + 4, 4);
    if (size > length - at - 8) return truncated("a chunk of " + std::to_string(size) + " bytes");
    if (at == 12) {
      if (type != "JSON") return inputError(name + ": GLB container: the first chunk is not JSON");
      chunks.json = text(at + 8, size);
    } else if (type == std::string_view("BIN\0", 4) && !chunks.bin) {
      chunks.bin = std::span(bytes).subspan(at + 8, size);
    }
    at += 8 + (size + 3) / 4 * 4;
  }
  return chunks;
}

bool nestsTooDeep(std::string_view json) {
  int depth = 0;
  bool inString = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (inString) {
      if (c == '\\')
        ++i;
      else if (c == '"')
        inString = false;
    } else if (c == '"') {
      inString = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxJsonDepth) return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

Expected<Json> parseJson(std::string_view text, const std::string& name) {
  if (nestsTooDeep(text))
    return inputError(name + ": JSON: nested deeper than " + std::to_string(kMaxJsonDepth) + " levels");
  // A GLB pads its JSON with spaces; some writers pad with zeros.
  while (!text.empty() && text.back() == '\0') text.remove_suffix(1);
  try {
    return Json::parse(text);
  } catch (const std::exception& e) {
    std::string_view why = e.what();
    if (const auto end = why.find("] "); end != std::string_view::npos) why.remove_prefix(end + 2);
    return inputError(name + ": JSON: " + std::string(why));
  }
}

std::optional<Error> checkAsset(const Json& root, const std::string& name) {
  const auto place = [&](const char* key) -> const Json* {
    if (!root.is_object() || !root.contains("asset") || !root["asset"].is_object()) return nullptr;
    const auto it = root["asset"].find(key);
    return it != root["asset"].end() && it->is_string() ? &*it : nullptr;
  };
  const Json* version = place("version");
  if (!version) return inputError(name + ": asset/version: is missing; is this a glTF 2.0 file?");
  const auto text = version->get<std::string>();
  if (text.rfind("2.", 0) != 0 && text != "2")
    return inputError(name + ": asset/version: '" + text + "' is not 2.x; convert the file to glTF 2.0");
  // glTF 2.0, section 3.2: a file whose minVersion is newer than the reader must not be read.
  if (const Json* minimum = place("minVersion"); minimum && *minimum != "2.0")
    return inputError(name + ": asset/minVersion: '" + minimum->get<std::string>() +
                      "' asks for more than glTF 2.0; export as 2.0");
  return std::nullopt;
}

/// Tells whether any "extensions" object inside of `json` names the extension.
bool usesExtension(const Json& json, const std::string& name) {
  if (json.is_object()) {
    if (const auto it = json.find("extensions"); it != json.end() && it->is_object() && it->contains(name)) return true;
  } else if (!json.is_array()) {
    return false;
  }
  return std::any_of(json.begin(), json.end(), [&](const Json& item) { return usesExtension(item, name); });
}

std::optional<Error> checkRequiredExtensions(const Json& root, GltfDocument& document) {
  const auto required = root.find("extensionsRequired");
  if (required == root.end() || !required->is_array()) return std::nullopt;
  for (const Json& extension : *required) {
    if (!extension.is_string()) continue;
    const auto& text = extension.get_ref<const std::string&>();
    if (std::find(kHandledExtensions.begin(), kHandledExtensions.end(), text) != kHandledExtensions.end()) continue;
    if (usesExtension(root, text))
      return document.error("extensionsRequired", "'" + text + "' is not supported; export without it");
    document.warnings.push_back(document.name + ": extensionsRequired: '" + text +
                                "' is not supported; nothing in the file uses it");
  }
  return std::nullopt;
}

/// Makes integers of the numbers that are whole but written with a fraction (1.0). Returns whether there was any.
bool makeWholeNumbers(Json& json) {
  bool any = false;
  if (json.is_number_float()) {
    const auto value = json.get<double>();
    if (value < 0.0 || value > 9007199254740992.0 || value != std::floor(value)) return false;  // 2^53
    json = static_cast<std::uint64_t>(value);
    return true;
  }
  if (json.is_structured())
    for (Json& item : json) any = makeWholeNumbers(item) || any;
  return any;
}

/// Checks the document by the schema. Some writers print whole numbers as 1.0, which glTF does not allow for integers:
/// these are read with a warning.
std::optional<Error> checkSchema(Json& root, GltfDocument& document) {
  const auto problem = checkGltfSchema(root);
  if (!problem) return std::nullopt;
  if (!makeWholeNumbers(root)) return inputError(document.name + ": " + *problem);
  if (const auto other = checkGltfSchema(root)) return inputError(document.name + ": " + *other);
  document.warnings.push_back(document.name + ": " + *problem + "; numbers written as 1.0 are read as 1");
  return std::nullopt;
}

/// KHR_lights_punctual asks for ranges above 0; tinygltf's lights do not tell 0 from none.
void warnOfRanges(const Json& root, GltfDocument& document) {
  const Json::json_pointer lights("/extensions/KHR_lights_punctual/lights");
  if (!root.contains(lights)) return;
  for (const Json& light : root.at(lights))
    if (light.contains("range") && !(light["range"].get<double>() > 0.0))
      document.warnings.push_back(document.name + ": light '" + light.value("name", "") +
                                  "': a range must be above 0; it is left out");
}

Expected<GltfBuffer> loadBuffer(const GltfDocument& document, const Json& json, std::size_t index,
                                const std::optional<std::span<const std::uint8_t>>& bin) {
  const std::string place = "buffers/" + std::to_string(index);
  GltfBuffer buffer;
  const std::string uri = json.value("uri", "");
  if (uri.empty()) {
    // A buffer without bytes is an error only once something reads it: meshopt's fallback buffers are like that.
    if (index != 0 || !bin) return buffer;
    buffer.bytes = *bin;
  } else if (isDataUri(uri)) {
    auto decoded = decodeDataUri(uri);
    if (!decoded) return document.error(place + "/uri", decoded.error().message);
    buffer.owned = *std::move(decoded);
    buffer.bytes = buffer.owned;
  } else {
    auto file = resolveReference(document.folder, percentDecode(uri), document.options);
    if (!file) return document.error(place + "/uri", file.error().message);
    auto bytes = readFile(*file);
    if (!bytes) {
      buffer.problem = bytes.error().message + "; put the buffer beside the scene file";
      return buffer;
    }
    buffer.owned = *std::move(bytes);
    buffer.bytes = buffer.owned;
  }
  const auto length = json["byteLength"].get<std::uint64_t>();
  if (length > buffer.bytes.size())
    buffer.problem = "has " + std::to_string(buffer.bytes.size()) + " of its " + std::to_string(length) +
                     " bytes; export or copy the file again";
  buffer.bytes = buffer.bytes.first(std::min<std::size_t>(length, buffer.bytes.size()));
  buffer.present = true;
  return buffer;
}

/// tinygltf reads a copy without bytes to load; index accessors without a view (Draco, sparse), which it refuses,
/// point at a view of no bytes that is appended for them and taken away again.
Expected<tinygltf::Model> readModel(Json root, const std::string& name) {
  for (const char* key : {"buffers", "images", "animations"}) root.erase(key);
  const std::size_t views = root.contains("bufferViews") ? root["bufferViews"].size() : 0;
  if (root.contains("accessors"))
    for (Json& accessor : root["accessors"])
      if (!accessor.contains("bufferView")) accessor["bufferView"] = views;
  root["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 0}});

  tinygltf::Model model;
  tinygltf::TinyGLTF reader;
  std::string error, warning;
  const std::string text = root.dump();
  if (!reader.LoadASCIIFromString(&model, &error, &warning, text.data(), static_cast<unsigned>(text.size()), "", 0)) {
    std::replace(error.begin(), error.end(), '\n', ' ');
    return inputError(name + ": glTF: " + error);
  }
  for (auto& accessor : model.accessors)
    if (accessor.bufferView == static_cast<int>(views)) accessor.bufferView = -1;
  model.bufferViews.resize(views);
  return model;
}

tinygltf::Value toValue(const Json& json) {
  if (json.is_object()) {
    tinygltf::Value::Object object;
    for (const auto& [key, item] : json.items()) object.emplace(key, toValue(item));
    return tinygltf::Value(std::move(object));
  }
  if (json.is_array()) {
    tinygltf::Value::Array array;
    for (const Json& item : json) array.push_back(toValue(item));
    return tinygltf::Value(std::move(array));
  }
  if (json.is_boolean()) return tinygltf::Value(json.get<bool>());
  if (json.is_number()) return tinygltf::Value(json.get<double>());
  if (json.is_string()) return tinygltf::Value(json.get<std::string>());
  return {};
}

}  // namespace

std::optional<tinygltf::Value> valueOfJson(const std::string& text) {
  if (nestsTooDeep(text)) return std::nullopt;
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return std::nullopt;
  return toValue(json);
}

Expected<std::span<const std::uint8_t>> GltfDocument::viewBytes(int view) const {
  const auto index = static_cast<std::size_t>(view);
  const std::string place = "bufferViews/" + std::to_string(view);
  if (!decodedViews[index].empty()) return std::span<const std::uint8_t>(decodedViews[index]);
  const auto& v = model.bufferViews[index];
  const GltfBuffer& buffer = buffers[static_cast<std::size_t>(v.buffer)];
  const bool fits = v.byteOffset <= buffer.bytes.size() && v.byteLength <= buffer.bytes.size() - v.byteOffset;
  if (!buffer.problem.empty() && !(buffer.present && fits))
    return error("buffers/" + std::to_string(v.buffer), buffer.problem);
  if (!buffer.present)
    return error(place, "buffers/" + std::to_string(v.buffer) +
                            " has neither a uri nor a GLB chunk; export or copy the file again");
  if (!fits)
    return error(place, std::to_string(v.byteLength) + " bytes from " + std::to_string(v.byteOffset) +
                            " on do not fit buffers/" + std::to_string(v.buffer) + ", which has " +
                            std::to_string(buffer.bytes.size()) + "; export or copy the file again");
  return buffer.bytes.subspan(v.byteOffset, v.byteLength);
}

double valueNumber(const tinygltf::Value& object, const char* key, double fallback) {
  if (!object.IsObject() || !object.Has(key)) return fallback;
  const auto& value = object.Get(key);
  return value.IsNumber() ? value.GetNumberAsDouble() : fallback;
}

Expected<GltfDocument> openGltf(std::vector<std::uint8_t> bytes, const std::string& name,
                                const std::filesystem::path& folder, const LoadOptions& options) {
  GltfDocument document;
  document.name = name;
  document.folder = folder;
  document.options = options;
  document.container = std::move(bytes);
  auto chunks = splitContainer(document.container, name);
  if (!chunks) return chunks.error();
  auto root = parseJson(chunks->json, name);
  if (!root) return root.error();
  if (auto error = checkAsset(*root, name)) return *error;
  if (auto error = checkRequiredExtensions(*root, document)) return *error;
  if (auto error = checkSchema(*root, document)) return *error;
  warnOfRanges(*root, document);

  if (root->contains("buffers"))
    for (const Json& json : (*root)["buffers"]) {
      auto buffer = loadBuffer(document, json, document.buffers.size(), chunks->bin);
      if (!buffer) return buffer.error();
      if (!buffer->problem.empty())
        document.warnings.push_back(name + ": buffers/" + std::to_string(document.buffers.size()) + ": " +
                                    buffer->problem + " (nothing that is needed lies there)");
      document.buffers.push_back(*std::move(buffer));
    }
  if (root->contains("images"))
    for (const Json& json : (*root)["images"])
      document.images.push_back(
          {json.value("name", ""), json.value("uri", ""), json.value("mimeType", ""), json.value("bufferView", -1)});
  auto model = readModel(*std::move(root), name);
  if (!model) return model.error();
  document.model = *std::move(model);
  document.decodedViews.resize(document.model.bufferViews.size());
  if (auto decoded = decodeMeshoptViews(document); !decoded) return decoded.error();
  return document;
}

}  // namespace lumel
