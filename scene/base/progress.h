// How long work reports progress and learns that it should stop.
#pragma once

#include <cstdint>
#include <string_view>

namespace lumel {

/// Implemented by the command line (a bar with an ETA on a terminal); the base class is silent.
/// begin and end come from one thread; advance and cancelled may be called from any thread.
class Progress {
 public:
  virtual ~Progress() = default;
  virtual void begin(std::string_view /*stage*/, std::uint64_t /*totalWork*/) {}
  virtual void advance(std::uint64_t /*work*/) {}
  virtual void end() {}
  /// True once the user asked to stop; work in progress returns interrupted() at its next convenient point.
  virtual bool cancelled() const { return false; }
};

/// Returns the progress of work that nobody watches or stops.
inline Progress& noProgress() {
  static Progress silent;
  return silent;
}

}  // namespace lumel
