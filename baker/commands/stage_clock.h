// Wall time per stage.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "baker/files/write/bake_files.h"
#include "scene/base/stopwatch.h"

namespace lumel {

class StageClock {
 public:
  /// Prints a line for each stage that ends, unless quiet.
  explicit StageClock(bool quiet) : quiet_(quiet) {}

  /// Ends the stage that runs, if any, and starts the next.
  void start(const std::string& stage) {
    stop();
    stages_.push_back({stage, 0.0});
    stopwatch_ = {};
    running_ = true;
  }
  void stop() {
    if (!running_) return;
    running_ = false;
    stages_.back().seconds = stopwatch_.seconds();
    if (!quiet_) std::fprintf(stderr, "%-8s %7.2f s\n", stages_.back().stage.c_str(), stages_.back().seconds);
  }
  const std::vector<StageTime>& stages() const { return stages_; }

 private:
  std::vector<StageTime> stages_;
  Stopwatch stopwatch_;  // of the stage that runs
  bool running_ = false;
  bool quiet_ = false;
};

}  // namespace lumel
