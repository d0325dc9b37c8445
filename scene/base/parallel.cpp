#include "scene/base/parallel.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "scene/base/check.h"

#ifdef LUMEL_THREAD_SANITIZER
#include <sanitizer/tsan_interface.h>

/// What libraries that are not instrumented do with memory is not judged.
extern "C" const char* __tsan_default_options() { return "ignore_noninstrumented_modules=1"; }
#endif

namespace lumel {
namespace {

/// What the thread sanitizer has to be told, since TBB is not instrumented: a loop's bodies begin after its call and
/// end before it returns, in no order among each other. Nothing in other builds.
class LoopOrder {
 public:
#ifdef LUMEL_THREAD_SANITIZER
  void call() { __tsan_release(&begin_); }
  void bodyBegins() { __tsan_acquire(&begin_); }
  void bodyEnds() { __tsan_release(&end_); }
  void callReturns() { __tsan_acquire(&end_); }

 private:
  char begin_ = 0, end_ = 0;
#else
  void call() {}
  void bodyBegins() {}
  void bodyEnds() {}
  void callReturns() {}
#endif
};

}  // namespace

void checkFailed(const char* expression, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: check failed: %s\n", file, line, expression);
  std::abort();
}

void parallelFor(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body) {
  LUMEL_CHECK(grain > 0);
  const std::size_t blocks = (count + grain - 1) / grain;
  LoopOrder order;
  order.call();
  // Isolated: who waits for the end of a loop inside of another one takes nothing up from the outer, which might last.
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(
        std::size_t{0}, blocks,
        [&](std::size_t block) noexcept {
          order.bodyBegins();
          body(block * grain, std::min(count, (block + 1) * grain));
          order.bodyEnds();
        },
        tbb::simple_partitioner{});
  });
  order.callReturns();
}

struct ThreadLimit::Impl {
  std::optional<tbb::global_control> control;
};

ThreadLimit::ThreadLimit(int threads) : impl_(std::make_unique<Impl>()) {
  if (threads > 0)
    impl_->control.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
}

ThreadLimit::~ThreadLimit() = default;

int availableThreads() {
  return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

}  // namespace lumel
