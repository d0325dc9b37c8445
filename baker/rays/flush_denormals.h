// How a thread that adds up light treats the smallest floats.
#pragma once

#include <xmmintrin.h>

namespace lumel {

/// Makes this thread flush denormals to zero while the object lives. Denormals are far below any light that a map can
/// show, and they slow rays down.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040u); }  // FTZ | DAZ
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned int saved_;
};

}  // namespace lumel
