#include "ssbump/occlusion/horizon_kernel.h"

#include <cstring>

// Compiled with -ffp-contract=off: the same operations in the same order at every vector width, so the same bits.
namespace lumel::ssbump {
namespace {

#define LUMEL_INLINE inline __attribute__((always_inline))

template <int Lanes>
struct Simd {
  typedef float Floats __attribute__((vector_size(Lanes * 4)));
  typedef int Ints __attribute__((vector_size(Lanes * 4)));

  static LUMEL_INLINE void load(Floats& v, const float* p) {
    std::memcpy(&v, p, sizeof v);
#if defined(__x86_64__)
    asm("" : "+v"(v));  // in a register: loads across cache lines are what the loops wait for, none is done twice
#endif
  }
  static LUMEL_INLINE void store(float* p, const Floats& v) { std::memcpy(p, &v, sizeof v); }
};

/// Each of the first half of p's lanes twice.
template <int Lanes>
LUMEL_INLINE void loadTwice(typename Simd<Lanes>::Floats& v, const float* p) {
  typename Simd<Lanes>::Ints lane;
  for (int i = 0; i < Lanes; ++i) lane[i] = i / 2;
  Simd<Lanes>::load(v, p);
  v = __builtin_shuffle(v, lane);
}

/// Computes g = (atan t + t q) / 2 and s = t^2 q / 2 with q = 1 / (1 + t^2) for t in [0, 1e9], within 4e-8 of pi/2 or
/// less.
/// atan: odd polynomial on [0, 1] (least squares, own fit), that of the reciprocal above. One division for both:
/// 1 / (m (1 + t^2)) with m = max(t, 1).
template <class Floats>
LUMEL_INLINE void integrals(Floats& g, Floats& s, const Floats& t) {
  const Floats one = Floats{} + 1.0f;
  const Floats m = t > one ? t : one;
  const Floats r = one + t * t;
  const Floats d = one / (m * r);
  const Floats q = d * m;
  const Floats x = t > one ? d * r : t;
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
  const Floats arc = t > one ? 1.57079632679f - p : p;
  g = 0.5f * (arc + t * q);
  s = 0.5f * (1.0f - q);
}

constexpr float kSteepest = 1e9f;  // its cube is still finite; steeper is vertical to a float

/// Adds F(t) of every channel for one vector of horizon slopes.
template <int Lanes>
LUMEL_INLINE void accumulate(std::span<const LobeSlice> lobes, float* const* sums, int x,
                             const typename Simd<Lanes>::Floats& slope) {
  using S = Simd<Lanes>;
  using Floats = typename S::Floats;
  const Floats limit = Floats{} + kSteepest;
  const Floats t = slope < limit ? slope : limit;
  Floats g, s;
  integrals(g, s, t);
  for (std::size_t c = 0; c < lobes.size(); ++c) {
    const LobeSlice& slice = lobes[c];
    Floats f = slice.top - (slice.a * g + slice.c * s);
    const Floats open = Floats{} + slice.open;
    const Floats none = Floats{};
    f = t > slice.tLo ? f : open;
    if (slice.tHi <= kSteepest) f = t < slice.tHi ? f : none;
    Floats sum;
    S::load(sum, sums[c] + x);
    sum = sum + f;
    S::store(sums[c] + x, sum);
  }
}

/// Whether any lane is above zero.
template <int Lanes, int Vectors>
LUMEL_INLINE bool anyAboveZero(const typename Simd<Lanes>::Floats* v) {
  typename Simd<Lanes>::Floats most = v[0];
  for (int i = 1; i < Vectors; ++i) most = v[i] > most ? v[i] : most;
  typename Simd<Lanes>::Ints lane;
  for (int i = 0; i < Lanes; ++i) lane[i] = i;
  for (int half = Lanes / 2; half > 0; half /= 2) {
    const auto other = __builtin_shuffle(most, lane ^ half);
    most = other > most ? other : most;
  }
  return most[0] > 0;
}

/// What the farther cells say at height h above cell column x of row r.
template <int Lanes>
LUMEL_INLINE void fartherSlope(typename Simd<Lanes>::Floats& slope, const FarCells& cells, int r, int x,
                               const typename Simd<Lanes>::Floats& h) {
  using S = Simd<Lanes>;
  const FarCells& from = *cells.farther;
  typename S::Floats base, change, lowest;
  if (cells.fartherIsTwice) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(r / 2) * from.columns + x / 2;
    loadTwice<Lanes>(base, from.slopes + at);
    loadTwice<Lanes>(change, from.changes + at);
    loadTwice<Lanes>(lowest, from.lowest + r / 2 * from.heightStride + x / 2);
  } else {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(r) * from.columns + x;
    S::load(base, from.slopes + at);
    S::load(change, from.changes + at);
    S::load(lowest, from.lowest + r * from.heightStride + x);
  }
  slope = base + (h - lowest) * change;
  slope = slope > 0.0f ? slope : typename S::Floats{};
}

/// Slopes at heights h above the cells of row r from column x on: what lies farther, then the own windows.
template <int Lanes, int Vectors>
LUMEL_INLINE void startFar(const FarCells& cells, int r, int x, const typename Simd<Lanes>::Floats* h,
                           typename Simd<Lanes>::Floats* slope) {
  for (int v = 0; v < Vectors; ++v) {
    slope[v] = typename Simd<Lanes>::Floats{};
    if (cells.farther) fartherSlope<Lanes>(slope[v], cells, r, x + v * Lanes, h[v]);
  }
}

template <int Lanes>
LUMEL_INLINE void farCellsBody(const FarCells& cells) {
  using S = Simd<Lanes>;
  using Floats = typename S::Floats;
  constexpr int kVectors = kCellBlock / Lanes;
  for (int r = 0; r < cells.rows; ++r)
    for (int x = 0; x < cells.columns; x += kCellBlock) {
      Floats low[kVectors], high[kVectors], slopeLow[kVectors], slopeHigh[kVectors];
      for (int v = 0; v < kVectors; ++v) {
        S::load(low[v], cells.lowest + r * cells.heightStride + x + v * Lanes);
        S::load(high[v], cells.highest + r * cells.heightStride + x + v * Lanes);
      }
      startFar<Lanes, kVectors>(cells, r, x, low, slopeLow);
      startFar<Lanes, kVectors>(cells, r, x, high, slopeHigh);
      for (std::size_t s = 0; s < cells.windows.size(); ++s) {
        const float* p = cells.windows[s] + r * cells.windowStride + x;
        const float inverse = cells.inverseDistances[s];
        for (int v = 0; v < kVectors; ++v) {
          Floats h;
          S::load(h, p + v * Lanes);
          const Floats t = (h - low[v]) * inverse, u = (h - high[v]) * inverse;
          slopeLow[v] = t > slopeLow[v] ? t : slopeLow[v];
          slopeHigh[v] = u > slopeHigh[v] ? u : slopeHigh[v];
        }
      }
      for (int v = 0; v < kVectors; ++v) {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(r) * cells.columns + x + v * Lanes;
        const Floats span = high[v] - low[v];
        const Floats some = span > 0.0f ? span : Floats{} + 1.0f;
        S::store(cells.slopes + at, slopeLow[v]);
        S::store(cells.changes + at, (slopeHigh[v] - slopeLow[v]) / some);
      }
    }
}

/// The same for texels, in registers.
template <int Lanes, int Vectors>
LUMEL_INLINE void farTexels(const FarCells& cells, int r, int x, const typename Simd<Lanes>::Floats* own,
                            typename Simd<Lanes>::Floats* slope) {
  using Floats = typename Simd<Lanes>::Floats;
  startFar<Lanes, Vectors>(cells, r, x, own, slope);
  for (std::size_t s = 0; s < cells.windows.size(); ++s) {
    const float* p = cells.windows[s] + r * cells.windowStride + x;
    const float inverse = cells.inverseDistances[s];
    for (int v = 0; v < Vectors; ++v) {
      Floats h;
      Simd<Lanes>::load(h, p + v * Lanes);
      const Floats t = (h - own[v]) * inverse;
      slope[v] = t > slope[v] ? t : slope[v];
    }
  }
}

constexpr std::size_t kStepsPerLook = 24;  // between looks at whether anything higher can come

/// The near steps of the texels from column x on: several vectors, since independent chains hide the maximum's latency.
template <int Lanes, int Vectors>
LUMEL_INLINE void climb(const NearRow& row, const NearSlice& slice, int x, const typename Simd<Lanes>::Floats* own,
                        typename Simd<Lanes>::Floats* slope) {
  using S = Simd<Lanes>;
  using Floats = typename S::Floats;
  const std::span<const NearStep> steps = slice.steps;
  for (std::size_t begin = 0; begin < steps.size(); begin += kStepsPerLook) {
    Floats gain[Vectors];
    for (int v = 0; v < Vectors; ++v) gain[v] = (row.highest - own[v]) * steps[begin].inverseDistance - slope[v];
    if (!anyAboveZero<Lanes, Vectors>(gain)) return;
    const std::size_t end = begin + kStepsPerLook < steps.size() ? begin + kStepsPerLook : steps.size();
    for (std::size_t s = begin; s < end; ++s) {
      const NearStep& step = steps[s];
      const float* pa = row.own + step.a + x;
      const float* pb = row.own + step.b + x;
      for (int v = 0; v < Vectors; ++v) {
        Floats a, b;
        S::load(a, pa + v * Lanes);
        S::load(b, pb + v * Lanes);
        const Floats t = (a + step.fraction * (b - a) - own[v]) * step.inverseDistance;
        slope[v] = t > slope[v] ? t : slope[v];
      }
    }
  }
}

template <int Lanes>
LUMEL_INLINE void nearRowsBody(std::span<const NearRow> rows) {
  using S = Simd<Lanes>;
  constexpr int kVectors = 4;
  for (int x = 0; x < rows[0].width; x += Lanes * kVectors)
    for (const NearRow& row : rows) {
      typename S::Floats own[kVectors], slope[kVectors];
      for (int v = 0; v < kVectors; ++v) S::load(own[v], row.own + x + v * Lanes);
      for (const NearSlice& slice : row.slices) {
        farTexels<Lanes, kVectors>(slice.texels, row.row, row.column + x, own, slope);
        climb<Lanes, kVectors>(row, slice, x, own, slope);
        for (int v = 0; v < kVectors; ++v) accumulate<Lanes>(slice.lobes, row.sums, x + v * Lanes, slope[v]);
      }
    }
}

void nearRowsBaseline(std::span<const NearRow> rows) { nearRowsBody<4>(rows); }
void farCellsBaseline(const FarCells& cells) { farCellsBody<4>(cells); }
#if defined(__x86_64__)
__attribute__((target("avx2"))) void nearRowsAvx2(std::span<const NearRow> rows) { nearRowsBody<8>(rows); }
__attribute__((target("avx2"))) void farCellsAvx2(const FarCells& cells) { farCellsBody<8>(cells); }
__attribute__((target("avx512f,avx512vl,avx512dq"))) void nearRowsAvx512(std::span<const NearRow> rows) {
  nearRowsBody<16>(rows);
}
__attribute__((target("avx512f,avx512vl,avx512dq"))) void farCellsAvx512(const FarCells& cells) {
  farCellsBody<16>(cells);
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

void farCells(const FarCells& cells, [[maybe_unused]] SimdLevel level) {
#if defined(__x86_64__)
  if (level == SimdLevel::Avx512) return farCellsAvx512(cells);
  if (level == SimdLevel::Avx2) return farCellsAvx2(cells);
#endif
  farCellsBaseline(cells);
}

void nearRows(std::span<const NearRow> rows, [[maybe_unused]] SimdLevel level) {
#if defined(__x86_64__)
  if (level == SimdLevel::Avx512) return nearRowsAvx512(rows);
  if (level == SimdLevel::Avx2) return nearRowsAvx2(rows);
#endif
  nearRowsBaseline(rows);
}

}  // namespace lumel::ssbump
