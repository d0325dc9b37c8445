#include "ssbump/horizon_kernel.h"

#include <cstring>
#include <limits>

// Compiled with -ffp-contract=off: the same operations in the same order at every vector width, so the same bits.
namespace lumel::ssbump {
namespace {

#define LUMEL_INLINE inline __attribute__((always_inline))

template <int Lanes>
struct Simd {
  typedef float Floats __attribute__((vector_size(Lanes * 4)));
  typedef int Ints __attribute__((vector_size(Lanes * 4)));

  static LUMEL_INLINE void load(Floats& v, const float* p) { std::memcpy(&v, p, sizeof v); }
  static LUMEL_INLINE void store(float* p, const Floats& v) { std::memcpy(p, &v, sizeof v); }
};

/// atan for t >= 0 within 4e-8 of pi/2 or less: odd polynomial on [0, 1] (least squares, own fit), reciprocal above.
template <class Floats>
LUMEL_INLINE void arctangent(Floats& out, const Floats& t) {
  const Floats one = Floats{} + 1.0f;
  const Floats x = t > one ? one / t : t;
  const Floats z = x * x;
  Floats p = Floats{} + -0.00405452510f;
  p = p * z + 0.0218628623f;
  p = p * z + -0.0559122990f;
  p = p * z + 0.0964220640f;
  p = p * z + -0.139086394f;
  p = p * z + 0.199465695f;
  p = p * z + -0.333298614f;
  p = p * z + 0.999999336f;
  p = p * x;
  out = t > one ? 1.57079632679f - p : p;
}

/// Adds F(t) of every channel for one vector of horizon slopes.
template <int Lanes>
LUMEL_INLINE void accumulate(const HorizonRow& row, int x, const typename Simd<Lanes>::Floats& slope) {
  using S = Simd<Lanes>;
  using Floats = typename S::Floats;
  const Floats limit = Floats{} + 1e18f;  // its square is still finite
  const Floats t = slope < limit ? slope : limit;
  const Floats q = 1.0f / (1.0f + t * t);
  Floats arc;
  arctangent(arc, t);
  const Floats g = 0.5f * (arc + t * q);
  const Floats s = 0.5f * (1.0f - q);
  for (std::size_t c = 0; c < row.channels; ++c) {
    const LobeSlice& slice = row.slices[c];
    Floats f = slice.top - (slice.a * g + slice.c * s);
    const Floats open = Floats{} + slice.open;
    const Floats none = Floats{};
    f = t > slice.tLo ? f : open;
    f = t < slice.tHi ? f : none;
    Floats sum;
    S::load(sum, row.sums[c] + x);
    sum = sum + f;
    S::store(row.sums[c] + x, sum);
  }
}

constexpr int kVectors = 4;  // independent chains that hide the latency of the maximum

/// True where no lane of the block can find a higher slope at a distance of 1 / inverse or more.
template <int Lanes>
LUMEL_INLINE bool finished(const typename Simd<Lanes>::Floats* own, const typename Simd<Lanes>::Floats* slope,
                           float highest, float inverse) {
  using Floats = typename Simd<Lanes>::Floats;
  Floats most = (highest - own[0]) * inverse - slope[0];
  for (int v = 1; v < kVectors; ++v) {
    const Floats m = (highest - own[v]) * inverse - slope[v];
    most = m > most ? m : most;
  }
  typename Simd<Lanes>::Ints lane;
  for (int i = 0; i < Lanes; ++i) lane[i] = i;
  for (int half = Lanes / 2; half > 0; half /= 2) {
    const Floats other = __builtin_shuffle(most, lane ^ half);
    most = other > most ? other : most;
  }
  return most[0] <= 0;
}

template <int Lanes>
LUMEL_INLINE void climb(const HorizonRow& row, int x, const typename Simd<Lanes>::Floats* own,
                        typename Simd<Lanes>::Floats* slope) {
  using S = Simd<Lanes>;
  using Floats = typename S::Floats;
  std::size_t s = 0;
  for (std::size_t g = 0; g < row.lerpGroupCount; ++g) {
    if (finished<Lanes>(own, slope, row.highest, row.lerpGroups[g].inverse)) return;
    for (; s < row.lerpGroups[g].end; ++s) {
      const float* pa = row.lerpA[s] + x;
      const float* pb = row.lerpB[s] + x;
      const float fraction = row.fraction[s], inverse = row.lerpInverse[s];
      for (int v = 0; v < kVectors; ++v) {
        Floats a, b;
        S::load(a, pa + v * Lanes);
        S::load(b, pb + v * Lanes);
        const Floats t = (a + fraction * (b - a) - own[v]) * inverse;
        slope[v] = t > slope[v] ? t : slope[v];
      }
    }
  }
  s = 0;
  for (std::size_t g = 0; g < row.boxGroupCount; ++g) {
    if (finished<Lanes>(own, slope, row.highest, row.boxGroups[g].inverse)) return;
    for (; s < row.boxGroups[g].end; ++s) {
      const float* p = row.box[s] + x;
      const float inverse = row.boxInverse[s];
      for (int v = 0; v < kVectors; ++v) {
        Floats a;
        S::load(a, p + v * Lanes);
        const Floats t = (a - own[v]) * inverse;
        slope[v] = t > slope[v] ? t : slope[v];
      }
    }
  }
}

template <int Lanes>
LUMEL_INLINE void horizonRowBody(const HorizonRow& row) {
  using S = Simd<Lanes>;
  using Floats = typename S::Floats;
  for (int x = 0; x < row.width; x += Lanes * kVectors) {
    Floats own[kVectors], slope[kVectors];
    for (int v = 0; v < kVectors; ++v) {
      S::load(own[v], row.own + x + v * Lanes);
      slope[v] = Floats{};
    }
    climb<Lanes>(row, x, own, slope);
    for (int v = 0; v < kVectors; ++v) accumulate<Lanes>(row, x + v * Lanes, slope[v]);
  }
}

void horizonRowBaseline(const HorizonRow& row) { horizonRowBody<4>(row); }
#if defined(__x86_64__)
__attribute__((target("avx2"))) void horizonRowAvx2(const HorizonRow& row) { horizonRowBody<8>(row); }
__attribute__((target("avx512f,avx512vl,avx512dq"))) void horizonRowAvx512(const HorizonRow& row) {
  horizonRowBody<16>(row);
}
#endif

}  // namespace

SimdLevel bestSimdLevel() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"))
    return SimdLevel::Avx512;
  if (__builtin_cpu_supports("avx2")) return SimdLevel::Avx2;
#endif
  return SimdLevel::Baseline;
}

void horizonRow(const HorizonRow& row, SimdLevel level) {
#if defined(__x86_64__)
  if (level == SimdLevel::Avx512) return horizonRowAvx512(row);
  if (level == SimdLevel::Avx2) return horizonRowAvx2(row);
#endif
  (void)level;
  horizonRowBaseline(row);
}

}  // namespace lumel::ssbump
