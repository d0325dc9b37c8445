#include "baker/study/study_setup.h"

#include <sys/resource.h>

namespace lumel {

double cpuSecondsNow() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

Expected<AtlasResult> atlasThatFits(const Scene& scene, AtlasOptions& options, Progress& progress) {
  constexpr int kMostPage = 4096;
  auto atlas = buildAtlas(scene, options, progress);
  while (!atlas && atlas.error().kind == ErrorKind::Usage && options.texelsPerMeter == 0.0f &&
         options.pageSize < kMostPage) {
    options.pageSize *= 2;
    atlas = buildAtlas(scene, options, progress);
  }
  return atlas;
}

}  // namespace lumel
