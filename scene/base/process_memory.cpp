#include "scene/base/process_memory.h"

#include <malloc.h>
#include <sys/resource.h>

#include <fstream>
#include <string>

namespace lumel {

std::size_t peakMemoryBytes() {
  // getrusage would count what the parent had when it forked.
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

void keepLargeArraysApart() { mallopt(M_MMAP_THRESHOLD, 1 << 20); }

void returnFreeMemory() { malloc_trim(0); }

}  // namespace lumel
