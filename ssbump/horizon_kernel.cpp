#include "ssbump/horizon_kernel.h"

#include <cstring>
#include <limits>

// Compiled with -ffp-contract=off: the same operations in the same order at every vector width, so the same bits.
namespace lumel::ssbump {
namespace {

#define LUMEL_INLINE inline __attribute__((always_inline))
#define LUMEL_LAMBDA __attribute__((always_inline))

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

/// Whether any lane is above the slope that matters.
template <int Lanes>
LUMEL_INLINE bool anyMatters(const typename Simd<Lanes>::Floats* gain) {
  using Floats = typename Simd<Lanes>::Floats;
  Floats most = gain[0];
  for (int v = 1; v < kVectors; ++v) most = gain[v] > most ? gain[v] : most;
  typename Simd<Lanes>::Ints lane;
  for (int i = 0; i < Lanes; ++i) lane[i] = i;
  for (int half = Lanes / 2; half > 0; half /= 2) {
    const Floats other = __builtin_shuffle(most, lane ^ half);
    most = other > most ? other : most;
  }
  return most[0] > kSlopeThatMatters;
}

/// Runs the groups' steps, `height(s, v)` being the height at step s for vector v. Decided texel by texel, whatever its
/// neighbours in the block: a group that a texel does not need leaves its slope alone. False once none needs more.
template <int Lanes, class Height>
LUMEL_INLINE bool climb(const StepGroup* groups, std::size_t groupCount, const float* inverses, float highest,
                        const typename Simd<Lanes>::Floats* own, typename Simd<Lanes>::Floats* slope,
                        const Height& height) {
  using Floats = typename Simd<Lanes>::Floats;
  std::size_t s = 0;
  for (std::size_t g = 0; g < groupCount; ++g) {
    Floats gain[kVectors], higher[kVectors];
    for (int v = 0; v < kVectors; ++v) {
      gain[v] = (highest - own[v]) * groups[g].inverse - slope[v];
      higher[v] = slope[v];
    }
    if (!anyMatters<Lanes>(gain)) return false;
    for (; s < groups[g].end; ++s) {
      const float inverse = inverses[s];
      for (int v = 0; v < kVectors; ++v) {
        Floats h;
        height(s, v, h);
        const Floats t = (h - own[v]) * inverse;
        higher[v] = t > higher[v] ? t : higher[v];
      }
    }
    for (int v = 0; v < kVectors; ++v) slope[v] = gain[v] > kSlopeThatMatters ? higher[v] : slope[v];
  }
  return true;
}

template <int Lanes>
LUMEL_INLINE void horizons(const HorizonRow& row, int x, const typename Simd<Lanes>::Floats* own,
                           typename Simd<Lanes>::Floats* slope) {
  using S = Simd<Lanes>;
  using Floats = typename S::Floats;
  const auto onEdge = [&](std::size_t s, int v, Floats& h) LUMEL_LAMBDA {
    Floats b;
    S::load(h, row.lerpA[s] + x + v * Lanes);
    S::load(b, row.lerpB[s] + x + v * Lanes);
    h = h + row.fraction[s] * (b - h);
  };
  const auto inWindow = [&](std::size_t s, int v, Floats& h) LUMEL_LAMBDA { S::load(h, row.box[s] + x + v * Lanes); };
  if (climb<Lanes>(row.lerpGroups, row.lerpGroupCount, row.lerpInverse, row.highest, own, slope, onEdge))
    climb<Lanes>(row.boxGroups, row.boxGroupCount, row.boxInverse, row.highest, own, slope, inWindow);
}

template <int Lanes>
LUMEL_INLINE void horizonRowsBody(std::span<const HorizonRow> rows) {
  using S = Simd<Lanes>;
  using Floats = typename S::Floats;
  for (int x = 0; x < rows[0].width; x += Lanes * kVectors)
    for (const HorizonRow& row : rows) {
      Floats own[kVectors], slope[kVectors];
      for (int v = 0; v < kVectors; ++v) {
        S::load(own[v], row.own + x + v * Lanes);
        slope[v] = Floats{};
      }
      horizons<Lanes>(row, x, own, slope);
      for (int v = 0; v < kVectors; ++v) accumulate<Lanes>(row, x + v * Lanes, slope[v]);
    }
}

void horizonRowsBaseline(std::span<const HorizonRow> rows) { horizonRowsBody<4>(rows); }
#if defined(__x86_64__)
__attribute__((target("avx2"))) void horizonRowsAvx2(std::span<const HorizonRow> rows) { horizonRowsBody<8>(rows); }
__attribute__((target("avx512f,avx512vl,avx512dq"))) void horizonRowsAvx512(std::span<const HorizonRow> rows) {
  horizonRowsBody<16>(rows);
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

void horizonRows(std::span<const HorizonRow> rows, SimdLevel level) {
#if defined(__x86_64__)
  if (level == SimdLevel::Avx512) return horizonRowsAvx512(rows);
  if (level == SimdLevel::Avx2) return horizonRowsAvx2(rows);
#endif
  (void)level;
  horizonRowsBaseline(rows);
}

}  // namespace lumel::ssbump
