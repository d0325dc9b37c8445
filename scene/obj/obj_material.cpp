#include "scene/obj/obj_material.h"

#include <algorithm>
#include <map>
#include <optional>

#include "scene/files/file_access.h"
#include "scene/images/image_io.h"
#include "scene/images/image_type.h"

namespace lumel {
namespace {

class ObjMaterialLoader {
 public:
  ObjMaterialLoader(const std::string& name, const std::filesystem::path& folder, const LoadOptions& options,
                    Scene& scene)
      : name_(name), folder_(folder), options_(options), scene_(scene) {}

  std::optional<Error> add(const ObjMaterial& source);

 private:
  void warn(const std::string& text) { scene_.report.warnings.push_back(name_ + ": " + text); }
  Expected<TextureRef> reference(const ObjMap& map);
  Expected<int> image(const std::string& file);
  std::optional<LoadedImage> decode(int image);
  std::optional<Error> addAlpha(const ObjMaterial& source, Material& material);
  std::optional<Error> addNormals(const ObjMaterial& source, Material& material);

  const std::string& name_;
  const std::filesystem::path& folder_;
  const LoadOptions& options_;
  Scene& scene_;
  std::map<std::string, int> images_;  // file -> scene.images; also those that are missing
};

/// The image's index; a missing one has an index too, and no bytes. Each file is read (and warned of) once.
Expected<int> ObjMaterialLoader::image(const std::string& file) {
  if (const auto it = images_.find(file); it != images_.end()) return it->second;
  // A path with a drive letter is another machine's; the file may lie beside the scene.
  const bool foreign = file.size() > 2 && file[1] == ':';
  const std::string reference =
      foreign ? file.substr(file.rfind('/') == std::string::npos ? 2 : file.rfind('/') + 1) : file;
  auto path = resolveReference(folder_, reference, options_);
  if (!path) return inputError(name_ + ": MTL: " + path.error().message);
  ImageSource source;
  source.name = file;
  if (auto bytes = readFile(*path)) {
    source.encoded = *std::move(bytes);
    source.mimeType = imageMimeType(source.encoded);
    if (source.mimeType.empty() && lowerCaseExtension(file) == ".tga") source.mimeType = "image/x-tga";
    if (source.mimeType.empty()) {
      warn("MTL: '" + file + "' is not an image of a known type; colour counts as grey, emission as black");
      source.encoded.clear();
    }
  } else {
    warn("MTL: " + bytes.error().message + "; colour counts as grey, emission as black");
  }
  const int index = static_cast<int>(scene_.images.size());
  scene_.images.push_back(std::move(source));
  images_[file] = index;
  return index;
}

/// MTL's -s and -o work on UVs that run up; u' = s u + o holds there, and v' = s v + 1 - s - o in a v that runs down.
Expected<TextureRef> ObjMaterialLoader::reference(const ObjMap& map) {
  TextureRef ref;
  if (map.file.empty()) return ref;
  auto index = image(map.file);
  if (!index) return index.error();
  ref.image = *index;
  ref.uvMatrix =
      Mat3(Vec3(map.scale.x, 0, 0), Vec3(0, map.scale.y, 0), Vec3(map.offset.x, 1 - map.scale.y - map.offset.y, 1));
  if (map.clamp) ref.wrapU = ref.wrapV = Wrap::Clamp;
  return ref;
}

std::optional<LoadedImage> ObjMaterialLoader::decode(int index) {
  const ImageSource& source = scene_.images[static_cast<std::size_t>(index)];
  if (source.encoded.empty()) return std::nullopt;
  auto loaded = readImage(source.encoded, source.name);
  if (loaded) return *std::move(loaded);
  warn("MTL: " + loaded.error().message);
  return std::nullopt;
}

/// Opacity of a map_d image: its alpha channel, else its grey.
float opacity(const LoadedImage& loaded, int x, int y) {
  const float* p = loaded.image.at(x, y);
  const int channels = loaded.image.channels;
  if (channels == 2 || channels >= 4) return p[channels == 2 ? 1 : 3];
  return channels == 1 ? p[0] : luminance({p[0], p[1], p[2]});
}

std::optional<Error> ObjMaterialLoader::addAlpha(const ObjMaterial& source, Material& material) {
  material.baseColor.w = source.dissolve;
  if (source.dissolve < 1) material.alphaMode = AlphaMode::Blend;
  if (source.alphaMap.file.empty()) return std::nullopt;
  auto index = image(source.alphaMap.file);
  if (!index) return index.error();
  const auto alpha = decode(*index);
  if (!alpha) return std::nullopt;
  material.alphaMode = AlphaMode::Mask;
  const bool sameFile = source.alphaMap.file == source.diffuseMap.file;
  if (sameFile && (alpha->image.channels == 2 || alpha->image.channels >= 4)) return std::nullopt;

  const auto color = material.baseColorMap ? decode(material.baseColorMap.image) : std::nullopt;
  const Image& size = color ? color->image : alpha->image;
  Image combined(size.width, size.height, 4, 1.0f);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      float* out = combined.at(x, y);
      if (color) {
        const bool grey = color->image.channels < 3;
        for (int c = 0; c < 3; ++c) out[c] = color->image.at(x, y)[grey ? 0 : c];
      }
      out[3] = opacity(
          *alpha,
          static_cast<int>((x + 0.5f) * static_cast<float>(alpha->image.width) / static_cast<float>(size.width)),
          static_cast<int>((y + 0.5f) * static_cast<float>(alpha->image.height) / static_cast<float>(size.height)));
    }
  auto png = encodePng(combined);
  if (!png) return png.error();
  if (!material.baseColorMap) {
    auto ref = reference(source.alphaMap);
    if (!ref) return ref.error();
    material.baseColorMap = *ref;
  }
  material.baseColorMap.image = static_cast<int>(scene_.images.size());
  scene_.images.push_back({source.diffuseMap.file + " + " + source.alphaMap.file, "image/png", *std::move(png)});
  return std::nullopt;
}

/// Whether the mean colour is that of tangent-space normals: about (0.5, 0.5, 1), and coloured at all.
bool looksLikeNormals(const LoadedImage& loaded) {
  if (loaded.image.channels < 3) return false;
  Vec3d mean(0);
  for (int y = 0; y < loaded.image.height; ++y)
    for (int x = 0; x < loaded.image.width; ++x) mean += Vec3d(loaded.image.rgb(x, y));
  mean /= static_cast<double>(loaded.image.width) * loaded.image.height;
  return std::abs(mean.x - 0.5) < 0.15 && std::abs(mean.y - 0.5) < 0.15 && mean.z > 0.7;
}

std::optional<Error> ObjMaterialLoader::addNormals(const ObjMaterial& source, Material& material) {
  const bool declared = !source.normalMap.file.empty();
  const ObjMap& map = declared ? source.normalMap : source.bumpMap;
  if (map.file.empty()) return std::nullopt;
  auto ref = reference(map);
  if (!ref) return ref.error();
  const auto loaded = decode(ref->image);
  if (!loaded) return std::nullopt;
  if (!declared && !looksLikeNormals(*loaded)) {
    warn("MTL: material '" + source.name + "': bump map '" + map.file + "' holds heights, not normals; ignored");
    return std::nullopt;
  }
  material.normalMap = *ref;
  material.normalScale = map.bumpScale;
  return std::nullopt;
}

std::optional<Error> ObjMaterialLoader::add(const ObjMaterial& source) {
  Material material;
  material.name = source.name;
  material.baseColor = Vec4(source.diffuse, 1.0f);
  material.roughness = source.roughness;
  material.metallic = source.metallic;
  material.emission = source.emission;
  auto color = reference(source.diffuseMap);
  if (!color) return color.error();
  material.baseColorMap = *color;
  auto emission = reference(source.emissionMap);
  if (!emission) return emission.error();
  material.emissionMap = *emission;
  if (material.emissionMap && material.emission == Vec3(0)) material.emission = Vec3(1);
  if (auto error = addAlpha(source, material)) return error;
  if (auto error = addNormals(source, material)) return error;
  scene_.materials.push_back(std::move(material));
  return std::nullopt;
}

/// Images that only served to make others go.
void dropUnusedImages(Scene& scene) {
  std::vector<int> renumbered(scene.images.size(), -1);
  std::vector<ImageSource> kept;
  for (Material& material : scene.materials)
    for (TextureRef* ref : {&material.baseColorMap, &material.normalMap, &material.emissionMap}) {
      if (!*ref) continue;
      const auto old = static_cast<std::size_t>(ref->image);
      if (renumbered[old] < 0) {
        renumbered[old] = static_cast<int>(kept.size());
        kept.push_back(std::move(scene.images[old]));
      }
      ref->image = renumbered[old];
    }
  scene.images = std::move(kept);
}

}  // namespace

Expected<void> loadObjMaterials(const ObjFile& file, const std::string& name, const std::filesystem::path& folder,
                                const LoadOptions& options, Scene& scene) {
  ObjMaterialLoader loader(name, folder, options, scene);
  for (const ObjMaterial& material : file.materials)
    if (auto error = loader.add(material)) return *error;
  dropUnusedImages(scene);
  scene.materials.push_back(defaultMaterial());
  return {};
}

}  // namespace lumel
