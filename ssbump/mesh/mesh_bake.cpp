#include "scene/base/stopwatch.h"
#include "scene/load/load_scene.h"
#include "ssbump/mesh/mesh_source.h"

namespace lumel::ssbump {

Expected<BakeReport> bakeMesh(const std::filesystem::path& high, const std::filesystem::path& low,
                              const MeshSettings& settings, Progress& progress) {
  const Stopwatch sinceStart;
  auto highScene = loadScene(high);
  if (!highScene) return highScene.error();
  std::optional<Scene> lowScene;
  if (!low.empty()) {
    auto loaded = loadScene(low);
    if (!loaded) return loaded.error();
    lowScene = std::move(*loaded);
  }
  auto maps = MapSet::open(settings.maps, settings.width, settings.height, {},
                           {{"lumel:occlusion", "rays, " + std::to_string(settings.rays.count) +
                                                    " per texel, against " + high.filename().string()},
                            {"lumel:wrap", low.empty() && settings.wrap ? "yes" : "no"}},
                           progress);
  if (!maps) return maps.error();
  BakeReport report;
  report.width = settings.width;
  report.height = settings.height;
  report.prepareSeconds = sinceStart.seconds();
  auto texels = gatherMesh(*highScene, lowScene ? &*lowScene : nullptr, settings, maps->lobes(), progress);
  if (!texels) {
    const Error& e = texels.error();
    if (e.kind == ErrorKind::Interrupted) return e;
    return Error{e.kind, (e.message.starts_with("low-poly") ? low : high).string() + ": " + e.message};
  }
  report.occlusionSeconds = sinceStart.seconds() - report.prepareSeconds;
  if (auto done = maps->write(texels->normals, texels->occlusion, progress); !done) return done.error();
  if (auto done = maps->commit(progress); !done) return done.error();
  report.warnings = maps->warnings();
  for (const std::string& w : highScene->report.warnings) report.warnings.push_back(w);
  return report;
}

}  // namespace lumel::ssbump
