// Wall time per stage.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "baker/bake_files.h"

namespace lumel {

class StageClock {
 public:
  /// Prints a line for each stage that ends, unless quiet.
  explicit StageClock(bool quiet) : quiet_(quiet) {}

  /// Ends the stage that runs, if any, and starts the next.
  void start(const std::string& stage) {
    stop();
    stages_.push_back({stage, 0.0});
    started_ = Clock::now();
    running_ = true;
  }
  void stop() {
    if (!running_) return;
    running_ = false;
    stages_.back().seconds = std::chrono::duration<double>(Clock::now() - started_).count();
    if (!quiet_) std::fprintf(stderr, "%-8s %7.2f s\n", stages_.back().stage.c_str(), stages_.back().seconds);
  }
  const std::vector<StageTime>& stages() const { return stages_; }

 private:
  using Clock = std::chrono::steady_clock;
  std::vector<StageTime> stages_;
  Clock::time_point started_;
  bool running_ = false;
  bool quiet_ = false;
};

}  // namespace lumel
