// Progress for people: a line with percentage and time left on a terminal, nothing elsewhere.
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "scene/base/progress.h"

namespace lumel {

/// Writes to stderr. From construction to destruction Ctrl-C (SIGINT) and SIGTERM are taken as a request to stop:
/// cancelled() turns true; a second one ends the program at once. One at a time.
class TerminalProgress : public Progress {
 public:
  explicit TerminalProgress(bool quiet);
  ~TerminalProgress() override;
  TerminalProgress(const TerminalProgress&) = delete;
  TerminalProgress& operator=(const TerminalProgress&) = delete;

  void begin(std::string_view stage, std::uint64_t totalWork) override;
  void advance(std::uint64_t work) override;
  void end() override;
  bool cancelled() const override;

 private:
  using Clock = std::chrono::steady_clock;
  void draw(Clock::time_point now);
  void clearLine();

  const bool quiet_;
  const bool terminal_;
  std::mutex drawing_;
  std::string stage_;
  std::uint64_t total_ = 0;
  std::atomic<std::uint64_t> done_{0};
  Clock::time_point started_;
  std::atomic<std::int64_t> nextDraw_{0};  // milliseconds after started_
};

}  // namespace lumel
