#include "baker/commands/terminal_progress.h"

#include <unistd.h>
#include <csignal>
#include <cstdio>

namespace lumel {
namespace {

// A signal handler may write to nothing else.
volatile std::sig_atomic_t stopRequested = 0;

extern "C" void requestStop(int signal) {
  if (stopRequested) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
  stopRequested = 1;
}

std::string duration(double seconds) {
  char buffer[32];
  const long whole = static_cast<long>(seconds + 0.5);
  if (whole >= 3600)
    std::snprintf(buffer, sizeof buffer, "%ldh%02ldm", whole / 3600, whole / 60 % 60);
  else if (whole >= 60)
    std::snprintf(buffer, sizeof buffer, "%ldm%02lds", whole / 60, whole % 60);
  else
    std::snprintf(buffer, sizeof buffer, "%.*fs", seconds < 10 ? 1 : 0, seconds);
  return buffer;
}

constexpr std::int64_t kMillisecondsBetweenDraws = 200;

}  // namespace

TerminalProgress::TerminalProgress(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {
  stopRequested = 0;
  std::signal(SIGINT, requestStop);
  std::signal(SIGTERM, requestStop);
}

TerminalProgress::~TerminalProgress() {
  clearLine();
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

void TerminalProgress::begin(std::string_view stage, std::uint64_t totalWork) {
  stage_ = stage;
  total_ = totalWork;
  done_ = 0;
  started_ = Clock::now();
  nextDraw_ = kMillisecondsBetweenDraws;
}

void TerminalProgress::advance(std::uint64_t work) {
  done_ += work;
  if (quiet_ || !terminal_) return;
  const auto now = Clock::now();
  const std::int64_t elapsed = std::chrono::duration_cast<std::chrono::milliseconds>(now - started_).count();
  std::int64_t due = nextDraw_;
  if (elapsed < due || !nextDraw_.compare_exchange_strong(due, elapsed + kMillisecondsBetweenDraws)) return;
  draw(now);
}

void TerminalProgress::draw(Clock::time_point now) {
  const std::lock_guard lock(drawing_);
  const double seconds = std::chrono::duration<double>(now - started_).count();
  const double share = total_ == 0 ? 0.0 : std::min(1.0, static_cast<double>(done_) / static_cast<double>(total_));
  if (share > 0.0)
    std::fprintf(stderr, "\r\033[K%-8s %5.1f%%  %s left", stage_.c_str(), 100.0 * share,
                 duration(seconds / share - seconds).c_str());
  else
    std::fprintf(stderr, "\r\033[K%-8s %s", stage_.c_str(), duration(seconds).c_str());
  std::fflush(stderr);
}

void TerminalProgress::end() { clearLine(); }

void TerminalProgress::clearLine() {
  if (quiet_ || !terminal_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
}

bool TerminalProgress::cancelled() const { return stopRequested != 0; }

}  // namespace lumel
