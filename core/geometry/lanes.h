#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace crease {

/// Eight numbers for SIMD: arithmetic and comparison work lane by lane. A function marked CREASE_WIDE_CLONES is
/// compiled twice, with and without AVX2; the program picks one when it starts. Both give the same bits, because
/// neither fuses multiplications with additions.
using Lanes [[gnu::vector_size(32)]] = float;
using HalfLanes [[gnu::vector_size(16)]] = float;
using IntLanes [[gnu::vector_size(32)]] = std::int32_t;
using ShortLanes [[gnu::vector_size(16)]] = std::int16_t;

// Sanitizers are not yet initialised when the program picks a clone. clang 14 does not flatten clones.
#if defined(__x86_64__) && defined(__ELF__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__)
#define CREASE_WIDE_CLONES [[gnu::target_clones("avx2", "default"), gnu::flatten]]
#else
#define CREASE_WIDE_CLONES
#endif

/// Before a loop whose passes do not depend on each other, so that gathers do not keep it out of the lanes.
#if defined(__GNUC__) && !defined(__clang__)
#define CREASE_INDEPENDENT_PASSES _Pragma("GCC ivdep")
#else
#define CREASE_INDEPENDENT_PASSES
#endif

#define CREASE_LANES_INLINE [[gnu::always_inline]] inline

CREASE_LANES_INLINE HalfLanes low(const Lanes& x) { return __builtin_shufflevector(x, x, 0, 1, 2, 3); }
CREASE_LANES_INLINE HalfLanes high(const Lanes& x) { return __builtin_shufflevector(x, x, 4, 5, 6, 7); }
CREASE_LANES_INLINE Lanes joined(const HalfLanes& low, const HalfLanes& high) {
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}

/// Loads four numbers from memory.
CREASE_LANES_INLINE HalfLanes load(const float* numbers) {
  HalfLanes result;
  std::memcpy(&result, numbers, sizeof result);
  return result;
}

/// Loads eight numbers from memory.
CREASE_LANES_INLINE Lanes eight(const float* numbers) {
  Lanes result;
  std::memcpy(&result, numbers, sizeof result);
  return result;
}
CREASE_LANES_INLINE void store(const Lanes& lanes, float* numbers) { std::memcpy(numbers, &lanes, sizeof lanes); }

CREASE_LANES_INLINE HalfLanes sqrt(const HalfLanes& x) {
#if defined(__SSE2__)
  return _mm_sqrt_ps(x);
#else
  return HalfLanes{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
#endif
}
/// One instruction where there is AVX: compilers join the eight roots.
CREASE_LANES_INLINE Lanes sqrt(const Lanes& x) {
  Lanes result;
  for (int k = 0; k < 8; ++k) result[k] = __builtin_sqrtf(x[k]);
  return result;
}

CREASE_LANES_INLINE float sum(const Lanes& x) {
  const HalfLanes halves = low(x) + high(x);
  return (halves[0] + halves[1]) + (halves[2] + halves[3]);
}

/// Lanes in a row. Containers of the library forget how a vector type is aligned; a struct keeps it.
template <std::size_t count>
struct alignas(32) LaneArray {
  Lanes items[count];  // NOLINT(*-avoid-c-arrays): see above

  CREASE_LANES_INLINE Lanes& operator[](std::size_t i) { return items[i]; }
  CREASE_LANES_INLINE const Lanes& operator[](std::size_t i) const { return items[i]; }
};

inline constexpr std::size_t kLaneCount = 8;

/// A vector as x, y, z, 0, which a load brings at once.
struct alignas(16) LaneRow {
  HalfLanes row{};
};

/// Of rows x, y, z, 0.
CREASE_LANES_INLINE float dot(const HalfLanes& a, const HalfLanes& b) {
  const HalfLanes products = a * b;
  return products[0] + products[1] + products[2];
}

/// Zero for a row without a direction.
CREASE_LANES_INLINE HalfLanes normalized(const HalfLanes& row) {
  const float square = dot(row, row);
  return square > 0 ? row / std::sqrt(square) : HalfLanes{};
}

/// Eight vectors, one in each lane.
struct alignas(32) LaneVectors {
  Lanes x{}, y{}, z{};

  CREASE_LANES_INLINE friend LaneVectors operator-(const LaneVectors& a, const LaneVectors& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  CREASE_LANES_INLINE friend LaneVectors operator+(const LaneVectors& a, const LaneVectors& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  CREASE_LANES_INLINE friend LaneVectors operator*(const Lanes& scale, const LaneVectors& a) {
    return {scale * a.x, scale * a.y, scale * a.z};
  }
  CREASE_LANES_INLINE Lanes squared_norm() const { return x * x + y * y + z * z; }
};

CREASE_LANES_INLINE Lanes dot(const LaneVectors& a, const LaneVectors& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

CREASE_LANES_INLINE LaneVectors cross(const LaneVectors& a, const LaneVectors& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Lane k of the result is lane k + 1 of `a`; the last is lane 0.
CREASE_LANES_INLINE Lanes shifted_down(const Lanes& a) { return __builtin_shufflevector(a, a, 1, 2, 3, 4, 5, 6, 7, 0); }
CREASE_LANES_INLINE LaneVectors shifted_down(const LaneVectors& a) {
  return {shifted_down(a.x), shifted_down(a.y), shifted_down(a.z)};
}

/// Lane k of the result is lane k − 1 of `a`; the first is lane 7.
CREASE_LANES_INLINE Lanes shifted_up(const Lanes& a) { return __builtin_shufflevector(a, a, 7, 0, 1, 2, 3, 4, 5, 6); }
CREASE_LANES_INLINE LaneVectors shifted_up(const LaneVectors& a) {
  return {shifted_up(a.x), shifted_up(a.y), shifted_up(a.z)};
}

/// Puts vector k, which is `row(k)` = (x, y, z, ignored), into lane k.
template <typename Row>
CREASE_LANES_INLINE LaneVectors transposed(Row row) {
  const Lanes v04 = joined(row(0), row(4)), v15 = joined(row(1), row(5)), v26 = joined(row(2), row(6)),
              v37 = joined(row(3), row(7));
  const Lanes xy01 = __builtin_shufflevector(v04, v15, 0, 8, 1, 9, 4, 12, 5, 13),
              xy23 = __builtin_shufflevector(v26, v37, 0, 8, 1, 9, 4, 12, 5, 13),
              zw01 = __builtin_shufflevector(v04, v15, 2, 10, 3, 11, 6, 14, 7, 15),
              zw23 = __builtin_shufflevector(v26, v37, 2, 10, 3, 11, 6, 14, 7, 15);
  return {__builtin_shufflevector(xy01, xy23, 0, 1, 8, 9, 4, 5, 12, 13),
          __builtin_shufflevector(xy01, xy23, 2, 3, 10, 11, 6, 7, 14, 15),
          __builtin_shufflevector(zw01, zw23, 0, 1, 8, 9, 4, 5, 12, 13)};
}

/// The vectors as rows (x, y, z, 0): numbers k and k + 4 are the halves of item k.
CREASE_LANES_INLINE LaneArray<4> row_pairs(const LaneVectors& vectors) {
  const Lanes none{}, xy01 = __builtin_shufflevector(vectors.x, vectors.y, 0, 8, 1, 9, 4, 12, 5, 13),
                      xy23 = __builtin_shufflevector(vectors.x, vectors.y, 2, 10, 3, 11, 6, 14, 7, 15),
                      z01 = __builtin_shufflevector(vectors.z, none, 0, 8, 1, 9, 4, 12, 5, 13),
                      z23 = __builtin_shufflevector(vectors.z, none, 2, 10, 3, 11, 6, 14, 7, 15);
  return {{__builtin_shufflevector(xy01, z01, 0, 1, 8, 9, 4, 5, 12, 13),
           __builtin_shufflevector(xy01, z01, 2, 3, 10, 11, 6, 7, 14, 15),
           __builtin_shufflevector(xy23, z23, 0, 1, 8, 9, 4, 5, 12, 13),
           __builtin_shufflevector(xy23, z23, 2, 3, 10, 11, 6, 7, 14, 15)}};
}

}  // namespace crease
