// The memory of this process as the system sees it.
#pragma once

#include <cstddef>

namespace lumel {

/// Most memory that this process has had resident so far.
std::size_t peakMemoryBytes();

/// Makes arrays of a MiB and more be taken from the system and given back to it one by one. It is called before the
/// first large allocation. The allocator's own way leaves holes of their size between others that live longer: a third
/// of the peak of a bake of a million triangles.
void keepLargeArraysApart();

/// Gives memory that was freed back to the system: many small pieces, freed by many threads, stay with the allocator.
void returnFreeMemory();

}  // namespace lumel
