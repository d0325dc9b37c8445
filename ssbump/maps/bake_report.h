// What a bake of ssbump maps did, for the summary.
#pragma once

#include <string>
#include <vector>

namespace lumel::ssbump {

struct BakeReport {
  int width = 0, height = 0;
  float lowestTexels = 0, highestTexels = 0;
  int reachTexels = 0;
  double prepareSeconds = 0, occlusionSeconds = 0;
  std::vector<std::string> warnings;
};

}  // namespace lumel::ssbump
