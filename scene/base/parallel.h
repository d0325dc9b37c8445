// The one door to oneTBB: parallel loops and the limit on threads.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace lumel {

/// Calls body(first, last) for disjoint ranges that cover [0, count), each of at most `grain` items, on all
/// available threads. Which thread runs which range is unspecified, the ranges' bounds are multiples of
/// `grain`: results that depend on the range alone are the same for any thread count.
/// body must not throw: an exception there ends the program.
void parallelFor(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body);

/// Limits every parallel loop (and Embree's builds) to `threads` threads while it lives; 0 = one per core.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Threads that a parallel loop may use now.
int availableThreads();

}  // namespace lumel
