#include "baker/export/engine_export.h"

#include <algorithm>

#include "baker/export/assets.h"
#include "baker/export/engine_writers.h"
#include "baker/export/map_export.h"
#include "baker/export/page_geometry.h"
#include "baker/files/names/bake_format.h"
#include "baker/files/names/conventions.h"
#include "lightmap/formats/texture_files.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

const char* nameOf(Engine engine) {
  constexpr const char* kNames[] = {"three", "godot", "bevy", "unity"};
  return kNames[static_cast<std::size_t>(engine)];
}

Json toJson(const Vec3& v) { return {v.x, v.y, v.z}; }

/// The table of lit nodes in the engine's own terms.
Json objectRows(Engine engine, const EngineScene& scene) {
  Json rows = Json::array();
  for (const LitNode& node : scene.nodes) {
    const auto& [page, scale, offset] = node.place;
    Json row = {{"name", node.name}, {"page", page}};
    if (engine == Engine::Unity) {
      row["scaleOffset"] = {scale.x, scale.y, offset.x, 1.0f - scale.y - offset.y};
    } else if (engine == Engine::Bevy) {
      row["min"] = {offset.x, offset.y};
      row["max"] = {offset.x + scale.x, offset.y + scale.y};
    } else {
      row["scale"] = {scale.x, scale.y};
      row["offset"] = {offset.x, offset.y};
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

MapExportOptions mapOptions(const EngineExportOptions& options) {
  MapExportOptions maps;
  maps.container = options.engine == Engine::Unity ? MapContainer::ExrHalf : MapContainer::Ktx2;
  maps.texels = options.texels.value_or(options.engine == Engine::Bevy ? TexelFormat::Rgb9e5 : TexelFormat::Half);
  maps.flatAlone = options.engine != Engine::Three;
  // three's loader takes the first level of textures without blocks alone, Bevy's shader reads no other.
  maps.mips = false;
  return maps;
}

/// The encoding whose maps the engine's files are made of.
std::string encodingFor(const EngineExportOptions& options, const Json& bakeJson, const std::string& file) {
  if (options.engine == Engine::Godot || options.engine == Engine::Unity) return bandEncoding(bakeJson, file);
  return options.encoding;
}

Expected<void> writeInstructions(Engine engine, ExportFolder& folder) {
  if (engine == Engine::Three)
    if (auto done = folder.add("lumel-three.js", asset("lumel-three.js")); !done) return done;
  if (engine == Engine::Unity)
    if (auto done = folder.add("LumelLightmaps.cs", asset("LumelLightmaps.cs")); !done) return done;
  return folder.add("README.md", asset(std::string(nameOf(engine)) + ".md"));
}

}  // namespace

Expected<Json> writeBevyVolumes(const EngineSource& source, ExportFolder& folder) {
  Json rows = Json::array();
  for (std::size_t number = 0; number < source.baked.volumes.size(); ++number) {
    const LightVolume& volume = source.baked.volumes[number];
    const auto& [nx, ny, nz] = volume.counts;
    // Slices one below the other, as they follow each other in the file: (Rx, 2 Ry) texels, 3 Rz of them.
    Image slices(nx, 2 * ny * 3 * nz, 3);
    for (int z = 0; z < nz; ++z)
      for (int y = 0; y < ny; ++y)
        for (int x = 0; x < nx; ++x)
          for (int face = 0; face < static_cast<int>(kCubeFaces); ++face) {
            const int axis = face / 2, half = face % 2;  // the cube's faces: +x, -x, +y and so on
            const int slice = axis * nz + z;
            slices.setRgb(x, slice * 2 * ny + half * ny + y,
                          volume.points[volume.indexOf(x, y, z)].cube[static_cast<std::size_t>(face)]);
          }
    if (const auto why = whyUnfit(TexelFormat::Rgb9e5, slices))
      return usageError("light volume " + std::to_string(number) + " holds " + *why + "; bake with a weaker light");
    GpuTexture texture{TexelFormat::Rgb9e5, nx, 2 * ny, 3 * nz, {encodeTexels(TexelFormat::Rgb9e5, slices)}, {}};
    const std::string name = "volume-" + std::to_string(number) + ".ktx2";
    const std::vector<std::uint8_t> file = ktx2File(texture);
    if (auto done = folder.add(name, std::span<const std::uint8_t>(file)); !done) return done.error();
    // The engine puts voxels into the middles of equal cells of the box; the points of a volume lie on its rim.
    const Vec3 counts(nx, ny, nz);
    rows.push_back({{"file", name},
                    {"name", volume.name},
                    {"translation", toJson(volume.origin + 0.5f * (counts - 1.0f) * volume.cell)},
                    {"scale", toJson(counts * volume.cell)},
                    {"intensity", 1.0}});
  }
  return rows;
}

Expected<Json> writeUnityDirections(const EngineSource& source, ExportFolder& folder) {
  Json rows = Json::array();
  for (std::size_t page = 0; page < source.baked.flat.size(); ++page) {
    const auto bands = bandsOf(source.baked, page);
    if (!bands) return rows;
    if (source.progress.cancelled()) return interrupted();
    const std::string name = "lightmap-" + std::to_string(page) + "-dir.png";
    WriteImageOptions options;
    options.format = PixelFormat::U8;
    const Image directions = unityDirections(*bands, source.baked, page, source.texels[page]);
    if (auto done = folder.add(name, directions, options); !done) return done.error();
    rows.push_back({{"file", name}, {"page", page}, {"map", "dir"}});
  }
  return rows;
}

Expected<Json> exportFor(const fs::path& bake, const Json& bakeJson, const EngineExportOptions& options,
                         ExportFolder& folder, Progress& progress) {
  const bool hasKtx2 = options.engine == Engine::Three || options.engine == Engine::Bevy;
  if (options.texels && !hasKtx2)
    return usageError(std::string("--texels: ") + nameOf(options.engine) + " takes its own; leave it out");
  if (options.engine == Engine::Three && options.texels == TexelFormat::Bc6h)
    return usageError("--texels bc6h: three's KTX2Loader does not read it; use half or rgb9e5");
  const std::string file = (bake / "bake.json").string();
  const auto baked = readBake(bake, {.encoding = encodingFor(options, bakeJson, file),
                                     .flat = true,
                                     .aux = true,
                                     .volumes = options.engine == Engine::Bevy});
  if (!baked) return baked.error();
  const MapExportOptions maps = mapOptions(options);
  if (options.engine == Engine::Three)
    if (auto done = checkFits(*baked->encoding, maps); !done) return done.error();
  const auto scene = engineScene(bake, {.keepLights = options.keepLights,
                                        .godotNames = options.engine == Engine::Godot,
                                        .unitPlaces = options.engine == Engine::Bevy});
  if (!scene) return scene.error();
  const EngineSource source{*baked, *scene, chartTexels(*baked, bakeJson), progress};
  Json description = {{"for", nameOf(options.engine)}};
  if (options.engine == Engine::Three) {
    description["encoding"] = describeEncoding(*baked->encoding);
    description["conventions"] = describeConventions(*baked->encoding);
  }
  const auto rows = options.engine == Engine::Godot ? writeGodot(source, folder)
                                                    : exportMaps(*baked, source.texels, maps, folder, progress);
  if (!rows) return rows.error();
  description["maps"] = *rows;
  if (options.engine == Engine::Unity) {
    const auto directions = writeUnityDirections(source, folder);
    if (!directions) return directions.error();
    for (const Json& row : *directions) description["maps"].push_back(row);
  }
  if (options.engine == Engine::Bevy) {
    const auto volumes = writeBevyVolumes(source, folder);
    if (!volumes) return volumes.error();
    description["volumes"] = *volumes;
  }
  description["objects"] = objectRows(options.engine, *scene);
  const std::vector<std::uint8_t> glb = scene->glb.bytes();
  if (auto done = folder.add("scene.glb", std::span<const std::uint8_t>(glb)); !done) return done.error();
  if (auto done = writeInstructions(options.engine, folder); !done) return done.error();
  return description;
}

}  // namespace lumel
