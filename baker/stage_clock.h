// Wall time per stage and the peak memory of the process.
#pragma once

#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <fstream>
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

/// Most memory that this process has had resident so far. (getrusage would count what its parent had when it forked.)
inline std::size_t peakMemoryBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "VmHWM:") {
      std::size_t kibibytes = 0;
      status >> kibibytes;
      return kibibytes * 1024;
    }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;  // Linux counts kibibytes
}

}  // namespace lumel
