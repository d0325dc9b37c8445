// The one door to Embree: the C API plus owners for its handles and its errors as values.
#pragma once

#include <embree3/rtcore.h>

#include <memory>
#include <string>

#include "scene/base/expected.h"
#include "scene/base/progress.h"

namespace lumel {

struct EmbreeRelease {
  void operator()(RTCDevice d) const { rtcReleaseDevice(d); }
  void operator()(RTCScene s) const { rtcReleaseScene(s); }
  void operator()(RTCGeometry g) const { rtcReleaseGeometry(g); }
};
using EmbreeDevice = std::unique_ptr<RTCDeviceTy, EmbreeRelease>;
using EmbreeScene = std::unique_ptr<RTCSceneTy, EmbreeRelease>;
using EmbreeGeometry = std::unique_ptr<RTCGeometryTy, EmbreeRelease>;

/// A device that uses TBB's current thread limit. Errors: Failed.
Expected<EmbreeDevice> newEmbreeDevice();

/// An empty scene with the settings that measured best: MEDIUM quality and ROBUST (no leaks at shared edges).
EmbreeScene newEmbreeScene(RTCDevice device);

/// Commits and reports what Embree says of it (out of memory, bad geometry) as Failed. Interrupted
/// once `progress` is cancelled.
Expected<void> commitScene(RTCDevice device, RTCScene scene, const std::string& what,
                           const Progress& progress = noProgress());

}  // namespace lumel
