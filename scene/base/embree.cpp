#include "scene/base/embree.h"

namespace lumel {
namespace {

const char* describe(RTCError error) {
  switch (error) {
    case RTC_ERROR_OUT_OF_MEMORY:
      return "out of memory";
    case RTC_ERROR_INVALID_ARGUMENT:
      return "invalid argument";
    case RTC_ERROR_INVALID_OPERATION:
      return "invalid operation";
    case RTC_ERROR_UNSUPPORTED_CPU:
      return "this processor is not supported (SSE2 is the least)";
    default:
      return "unknown error";
  }
}

}  // namespace

Expected<EmbreeDevice> newEmbreeDevice() {
  EmbreeDevice device(rtcNewDevice(nullptr));
  if (!device) return failure(std::string("Embree: ") + describe(rtcGetDeviceError(nullptr)));
  return device;
}

EmbreeScene newEmbreeScene(RTCDevice device) {
  EmbreeScene scene(rtcNewScene(device));
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  return scene;
}

Expected<void> commitScene(RTCDevice device, RTCScene scene, const std::string& what, const Progress& progress) {
  rtcSetSceneProgressMonitorFunction(
      scene, [](void* p, double) { return !static_cast<const Progress*>(p)->cancelled(); },
      const_cast<Progress*>(&progress));
  rtcCommitScene(scene);
  rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
  const RTCError error = rtcGetDeviceError(device);
  if (progress.cancelled()) return interrupted();
  if (error != RTC_ERROR_NONE) return failure(what + ": Embree: " + describe(error));
  return {};
}

}  // namespace lumel
