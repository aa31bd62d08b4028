// The body of brick_kernels_*.cpp, which compile it for different instruction sets. No inline
// function of a library may be called here: the linker keeps one copy of such a function for the
// whole program, and that could be the one compiled for AVX-512.
//
// The including file defines ESVR_KERNEL_NAMESPACE, ESVR_KERNEL_LANES (8 for one row of a brick, 16
// for two rows) and ESVR_KERNEL_NATIVE (floats in a register: ESVR_KERNEL_LANES or half of it).

#if defined(__SSE2__)
// GCC 12 warns about the undefined vectors in its own header.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <immintrin.h>
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif
#endif

#include "field/brick_kernels.h"
#include "field/line_form.h"
#include "field/ssim_window.h"

namespace esvr::ESVR_KERNEL_NAMESPACE {
namespace {

constexpr int kLanes = ESVR_KERNEL_LANES;    // floats in one row of a brick, or in two rows
constexpr int kNative = ESVR_KERNEL_NATIVE;  // floats in a register
constexpr int kRows = kLanes / 8;

typedef float Native __attribute__((vector_size(4 * kNative)));
typedef int NativeInt __attribute__((vector_size(4 * kNative)));

#if ESVR_KERNEL_NATIVE == ESVR_KERNEL_LANES
using Vec = Native;
#else
/// A vector of kLanes floats in one or two registers. Compilers turn vectors that are wider than a
/// register into scalar code, so they are divided here.
struct Vec {
  Native low, high;
};
inline Vec operator+(Vec a, Vec b) { return {a.low + b.low, a.high + b.high}; }
inline Vec operator-(Vec a, Vec b) { return {a.low - b.low, a.high - b.high}; }
inline Vec operator*(Vec a, Vec b) { return {a.low * b.low, a.high * b.high}; }
inline Vec operator+(Vec a, float b) { return {a.low + b, a.high + b}; }
inline Vec operator-(Vec a, float b) { return {a.low - b, a.high - b}; }
inline Vec operator*(Vec a, float b) { return {a.low * b, a.high * b}; }
inline Vec operator*(float a, Vec b) { return b * a; }
inline Vec operator-(float a, Vec b) { return {a - b.low, a - b.high}; }
inline Vec& operator+=(Vec& a, Vec b) { return a = a + b; }
inline Vec& operator+=(Vec& a, float b) { return a = a + b; }
#endif

/// A vector whose lanes are all the same.
inline Native splatNative(float f) { return f - Native{}; }
inline Vec splat(float f) { return f - Vec{}; }

/// Applies an operation on registers to a vector.
template <class Operation>
inline Native each(Operation operation, Native a) {
  return operation(a);
}
template <class Operation>
inline Native each(Operation operation, Native a, Native b) {
  return operation(a, b);
}
#if ESVR_KERNEL_NATIVE != ESVR_KERNEL_LANES
template <class Operation>
inline Vec each(Operation operation, Vec a) {
  return {operation(a.low), operation(a.high)};
}
template <class Operation>
inline Vec each(Operation operation, Vec a, Vec b) {
  return {operation(a.low, b.low), operation(a.high, b.high)};
}
#endif

inline Vec load(const float* p) {
  Vec v;
  __builtin_memcpy(&v, __builtin_assume_aligned(p, 16), sizeof v);
  return v;
}
inline void store(float* p, Vec v) {
  __builtin_memcpy(__builtin_assume_aligned(p, 16), &v, sizeof v);
}

/// 0 to 7 along z in each row of a vector, and the same numbers for x and y.
alignas(64) constexpr float kLaneZ[16] = {0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7};
alignas(64) constexpr float kLaneY[16] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};

// What instruction sets do in different ways. __m512 and the like are GCC's vectors of floats.

#if defined(__AVX512F__)

/// Bit i is set unless lane i of `a` exceeds `limit`. It is set if the lane is NaN.
inline unsigned notAbove(Vec a, float limit) {
  return _mm512_cmp_ps_mask((__m512)a, _mm512_set1_ps(limit), _CMP_NGT_UQ);
}
inline Vec smaller(Vec a, Vec b) { return (Vec)_mm512_min_ps((__m512)a, (__m512)b); }
inline Vec larger(Vec a, Vec b) { return (Vec)_mm512_max_ps((__m512)a, (__m512)b); }

/// 2^z. It has an error of 3 units of 2^-24.
inline Native powerOfTwo(Native z) {
  // A polynomial for 2^(z - floor(z)), and an instruction that multiplies it by 2^floor(z).
  const Native f = (Native)_mm512_reduce_ps((__m512)z, _MM_FROUND_TO_NEG_INF);
  Native p = f * 1.87757669e-3f + 8.98933969e-3f;
  p = p * f + 5.58263175e-2f;
  p = p * f + 0.240153611f;
  p = p * f + 0.693153083f;
  p = p * f + 0.99999994f;
  return (Native)_mm512_scalef_ps((__m512)p, (__m512)z);
}

#else

#if defined(__AVX2__)
inline unsigned notAbove(Vec a, float limit) {
  return unsigned(_mm256_movemask_ps(_mm256_cmp_ps((__m256)a, _mm256_set1_ps(limit), _CMP_NGT_UQ)));
}
#elif defined(__SSE2__)
inline unsigned notAbove(Vec a, float limit) {
  const __m128 l = _mm_set1_ps(limit);
  return unsigned(_mm_movemask_ps(_mm_cmpngt_ps((__m128)a.low, l)) |
                  _mm_movemask_ps(_mm_cmpngt_ps((__m128)a.high, l)) << 4);
}
#else
inline unsigned notAbove(Vec a, float limit) {
  float lanes[kLanes];
  __builtin_memcpy(lanes, &a, sizeof lanes);
  unsigned bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= unsigned(!(lanes[i] > limit)) << i;
  return bits;
}
#endif

inline Vec smaller(Vec a, Vec b) {
  return each([](Native v, Native w) { return v < w ? v : w; }, a, b);
}
inline Vec larger(Vec a, Vec b) {
  return each([](Native v, Native w) { return v > w ? v : w; }, a, b);
}

/// 2^z for z in [-126, 127], and 2^-126 for smaller z. It has an error of 4 units of 2^-24.
inline Native powerOfTwo(Native z) {
  constexpr float kRound =
      12582912.0f;  // 1.5 * 2^23: adding it rounds to an integer in the low bits
  const Native lowest = splatNative(-126.0f);
  z = z > lowest ? z : lowest;
  const Native shifted = z + kRound;
  const Native f = z - (shifted - kRound);
  Native p = f * 1.32764725e-3f + 9.67554096e-3f;
  p = p * f + 5.55071309e-2f;
  p = p * f + 0.240221202f;
  p = p * f + 0.693146944f;
  p = p * f + 1.00000012f;
  return (Native)((NativeInt)p + ((NativeInt)shifted << 23));
}

#endif

inline Vec phiOf(const KernelConstants<float>& k, Vec m) {
  constexpr float kLog2e = 1.44269504f;
  return each(
      [&k](Native v) {
        const Native power = powerOfTwo((v - k.shift) * kLog2e);
        const Native phi = k.numerator / (k.plateau + power) - k.base;
        return v < k.cutoff ? phi : Native{};
      },
      m);
}

/// residual * (phi + base) inside the support, and 0 outside, where phi is 0.
inline Vec weightedQuotient(const KernelConstants<float>& k, Vec phi, Vec residual) {
  return each([&k](Native p, Native r) { return p > 0.0f ? r * (p + k.base) : Native{}; }, phi,
              residual);
}

/// An ellipsoid in the frame of a brick. What depends on x only is in tables.
struct Local {
  float cy, cz;
  Vec dz;
  Vec firstT;  ///< t in the plane dx = 0 for y = 0 or, in the second row of a vector, 1
  alignas(64) float dx[kLanes];
  alignas(64) float sxDx[kLanes];
};

inline Local localise(const BrickForm& f, const float corner[3]) {
  Local l;
  l.cy = f.center[1] - corner[1];
  l.cz = f.center[2] - corner[2];
  l.dz = load(kLaneZ) - l.cz;
  l.firstT = load(kLaneY) - l.cy - l.dz * f.sz;
  const Vec dx = load(kLaneZ) - (f.center[0] - corner[0]);
  store(l.dx, dx);
  store(l.sxDx, dx * f.sx);
  return l;
}

/// The place in a brick of the vector of voxels that the lowest bit of PairTape::rows stands for.
struct Row {
  int x, y;
  explicit Row(std::uint64_t rows) {
    const int bit = __builtin_ctzll(rows);
    x = bit & 7, y = (bit >> 3) * kRows;
  }
  [[nodiscard]] int offset() const { return x * 64 + y * 8; }
  [[nodiscard]] Vec t(const Local& l) const { return (l.firstT + kLaneZ[y]) - l.sxDx[x]; }
};

/// The vectors of a brick that the support may meet, as PairTape::rows. Vectors outside the support
/// contribute exactly 0.
inline std::uint64_t rowsOf(const BrickForm& f, const Local& l) {
  constexpr int kSteps = kRows == 2 ? 2 : 8;  // a step tests the rows of four y, or of one
  // The lanes have all x and, if there are 16 of them, two even y.
  const Vec dx = load(l.dx), dy = load(kLaneY) * float(kRows) - l.cy;
  const Vec u = dx * f.inverseX, uu = u * u;
  const Vec firstV = dy * f.inverseY - dx * f.yByX, firstZ = dx * f.zByX + dy * f.zByY;
  const Vec low = splat(-l.cz * f.inverseZ), high = splat((7.0f - l.cz) * f.inverseZ);
  const auto meets = [&](float y) {
    const Vec v = firstV + y * f.inverseY, z = firstZ + y * f.zByY;
    const Vec w = smaller(larger(z, low), high) - z;
    return notAbove(uu + v * v + w * w, 1.0f);
  };
  std::uint64_t rows = 0;
  for (int step = 0; step < kSteps; ++step) {
    const float y = kLaneZ[step] * float(8 / kSteps);
    unsigned bits = meets(y);
    if constexpr (kRows == 2) bits |= meets(y + 1.0f);
    rows |= std::uint64_t(bits) << (step * kLanes);
  }
  return rows;
}

template <bool kTape>
inline void run(const BrickForm& f, const float corner[3], const KernelConstants<float>& k,
                float* sum, PairTape* tape) {
  const Local l = localise(f, corner);
  const std::uint64_t all = rowsOf(f, l);
  alignas(64) float pxDx[3][kLanes];
  Vec pzDz[3];
  for (int j = 0; j < 3; ++j) {
    pzDz[j] = l.dz * f.pz[j];
    store(pxDx[j], load(l.dx) * f.px[j]);
  }
  float* out = kTape ? tape->phi : nullptr;
  for (std::uint64_t rows = all; rows != 0; rows &= rows - 1) {
    const Row row(rows);
    const Vec u0 = pzDz[0] + pxDx[0][row.x], u1 = pzDz[1] + pxDx[1][row.x],
              u2 = pzDz[2] + pxDx[2][row.x];
    const Vec t = row.t(l);
    const Vec phi = phiOf(k, squaredAt(f, u0 * u0 + u1 * u1 + u2 * u2, t));
    float* const at = sum + row.offset();
    store(at, load(at) + f.intensity * phi);
    if constexpr (kTape) {
      store(out, phi);
      out += kLanes;
    }
  }
  if constexpr (kTape) {
    tape->rows = all;
    tape->floats = int(out - tape->phi);
  }
}

void add(const BrickForm& f, const float corner[3], const KernelConstants<float>& k, float* sum) {
  run<false>(f, corner, k, sum, nullptr);
}

void forward(const BrickForm& f, const float corner[3], const KernelConstants<float>& k, float* sum,
             PairTape& tape) {
  run<true>(f, corner, k, sum, &tape);
}

// Sums of lanes. The order of the additions is fixed for each instruction set.

constexpr int kMomentCount = sizeof(PairMoments) / sizeof(float);

inline float sumLanes(Vec v) {
  float s[kLanes];
  __builtin_memcpy(s, &v, sizeof s);
  float total = 0.0f;
  for (int i = 0; i < 8; ++i) {
    float lane = s[i];
    if constexpr (kRows == 2) lane += s[i + 8];
    total += lane;
  }
  return total;
}

#if defined(__AVX512F__)
/// The sums of neighbouring floats of two vectors, alternately of the first and the second one.
inline __m512 addNeighbours(Vec a, Vec b) {
  return _mm512_add_ps(_mm512_unpacklo_ps((__m512)a, (__m512)b),
                       _mm512_unpackhi_ps((__m512)a, (__m512)b));
}
inline __m512 addPairs(__m512 a, __m512 b) {
  const __m512d x = _mm512_castps_pd(a), y = _mm512_castps_pd(b);
  return _mm512_add_ps(_mm512_castpd_ps(_mm512_unpacklo_pd(x, y)),
                       _mm512_castpd_ps(_mm512_unpackhi_pd(x, y)));
}
inline __m512 addQuarters(__m512 a, __m512 b) {
  return _mm512_add_ps(_mm512_shuffle_f32x4(a, b, 0x88), _mm512_shuffle_f32x4(a, b, 0xdd));
}
inline void sumAll(const Vec (&v)[kMomentCount], float* sums) {
  static_assert(kMomentCount == 12);
  const __m512 s0 = addPairs(addNeighbours(v[0], v[1]), addNeighbours(v[2], v[3]));
  const __m512 s1 = addPairs(addNeighbours(v[4], v[5]), addNeighbours(v[6], v[7]));
  const __m512 s2 = addPairs(addNeighbours(v[8], v[9]), addNeighbours(v[10], v[11]));
  const __m512 all = addQuarters(addQuarters(s0, s1), addQuarters(s2, _mm512_setzero_ps()));
  _mm512_mask_storeu_ps(sums, 0x0fff, all);
}
#elif defined(__AVX2__)
inline void sumAll(const Vec (&v)[kMomentCount], float* sums) {
  static_assert(kMomentCount % 4 == 0);
  for (int i = 0; i < kMomentCount; i += 4) {
    const __m256 halves = _mm256_hadd_ps(_mm256_hadd_ps((__m256)v[i], (__m256)v[i + 1]),
                                         _mm256_hadd_ps((__m256)v[i + 2], (__m256)v[i + 3]));
    _mm_storeu_ps(sums + i,
                  _mm_add_ps(_mm256_castps256_ps128(halves), _mm256_extractf128_ps(halves, 1)));
  }
}
#else
inline void sumAll(const Vec (&v)[kMomentCount], float* sums) {
  for (int i = 0; i < kMomentCount; ++i) sums[i] = sumLanes(v[i]);
}
#endif

void backward(const BrickForm& f, const float corner[3], const KernelConstants<float>& k,
              const float* r, const PairTape& tape, PairMoments& moments) {
  const Local l = localise(f, corner);
  Vec s0{}, s0x{}, s0xx{}, s1{}, s1x{}, s2{}, rPhi{}, phi2{}, rEdge{};
  const float slopeBase = k.slope * k.base - 1.0f;
  const float* in = tape.phi;
  for (std::uint64_t rows = tape.rows; rows != 0; rows &= rows - 1, in += kLanes) {
    const Row row(rows);
    const Vec phi = load(in), g = load(r + row.offset()), t = row.t(l);
    const float dx = l.dx[row.x];
    const Vec rq = weightedQuotient(k, phi, g);
    const Vec w = rq * (phi * k.slope + slopeBase);  // r phi'
    const Vec wx = w * dx, wt = w * t;
    s0 += w;
    s0x += wx;
    s0xx += wx * dx;
    s1 += wt;
    s1x += wx * t;
    s2 += wt * t;
    rPhi += g * phi;
    phi2 += phi * phi;
    rEdge += rq - rq * phi;
  }
  const Vec s0z = s0 * l.dz;
  const Vec all[kMomentCount] = {s0x, s0z,       s0xx, s0x * l.dz, s0z * l.dz, s1,
                                 s1x, s1 * l.dz, s2,   rPhi,       phi2,       rEdge};
  float sums[kMomentCount];
  sumAll(all, sums);
  __builtin_memcpy(&moments, sums, sizeof sums);
}

void project(const PairTape& tape, const float* r, PairProjection& projection) {
  Vec rPhi{}, phi2{};
  const float* in = tape.phi;
  for (std::uint64_t rows = tape.rows; rows != 0; rows &= rows - 1, in += kLanes) {
    const Vec phi = load(in);
    rPhi += load(r + Row(rows).offset()) * phi;
    phi2 += phi * phi;
  }
  projection = {sumLanes(rPhi), sumLanes(phi2)};
}

void start(const float* target, float* r) {
  for (int v = 0; v < kBrickVoxels; v += kLanes) store(r + v, 0.0f - load(target + v));
}

double finish(const float* target, float low, float high, float* r) {
  Vec squares{};
  for (int v = 0; v < kBrickVoxels; v += kLanes) {
    const Vec t = load(target + v);
    const Vec clamped = smaller(larger(load(r + v), low - t), high - t);
    store(r + v, clamped);
    squares += clamped * clamped;
  }
  float lanes[kLanes];
  __builtin_memcpy(lanes, &squares, sizeof lanes);
  double sum = 0.0;
  for (const float lane : lanes) sum += double(lane);
  return sum;
}

void sumMoments(const PairMoments* moments, std::size_t count, MomentTotals& sums) {
  double total[kMomentCount] = {};
  for (std::size_t n = 0; n < count; ++n) {
    float m[kMomentCount];
    __builtin_memcpy(m, moments + n, sizeof m);
    for (int j = 0; j < kMomentCount; ++j) total[j] += double(m[j]);
  }
  __builtin_memcpy(&sums, total, sizeof total);
}

void addPlaces(const BrickForm& f, const float corner[3], const KernelConstants<float>& k,
               const PlaceBlock& places, float* sum) {
  const float cx = f.center[0] - corner[0], cy = f.center[1] - corner[1],
              cz = f.center[2] - corner[2];
  for (int i = 0; i < places.count; i += kLanes) {
    const Vec dx = load(places.x + i) - cx, dz = load(places.z + i) - cz;
    const Vec pz[3] = {dz * f.pz[0], dz * f.pz[1], dz * f.pz[2]};
    const Vec t = distanceAlong(f, load(places.y + i), cy, dx, dz);
    const Vec phi = phiOf(k, squaredAt(f, closestSquared(f, dx, pz), t));
    store(sum + i, load(sum + i) + f.intensity * phi);
  }
}

// The loops of SSIM. The compiler vectorises the loops over i.

/// One window sum. The window is symmetric, so two voxels share a multiplication.
inline double sumAt(const double* weights, const double* in, int stride) {
  double sum = weights[kSsimRadius] * in[kSsimRadius * stride];
  for (int tap = 0; tap < kSsimRadius; ++tap)
    sum += weights[tap] * (in[tap * stride] + in[(kSsimTaps - 1 - tap) * stride]);
  return sum;
}

void sumTaps(const double* weights, const double* in, int stride, double* __restrict out,
             int count) {
  for (int i = 0; i < count; ++i) out[i] = sumAt(weights, in + i, stride);
}

void sumRows(const double* weights, const double* in, double* __restrict out, int rows) {
  for (int row = 0; row < rows; ++row, in += kHaloSide, out += kBrickSide)
    for (int i = 0; i < kBrickSide; ++i) out[i] = sumAt(weights, in + i, 1);
}

void multiply(const double* a, const double* b, double* __restrict product, int count) {
  for (int i = 0; i < count; ++i) product[i] = a[i] * b[i];
}

}  // namespace

extern const BrickKernels kKernels;
const BrickKernels kKernels{ESVR_KERNEL_NAME, add,   forward, backward,
                            project,          start, finish,  sumMoments};
extern const AddPlaces kAddPlaces;
const AddPlaces kAddPlaces = addPlaces;
extern const SsimKernels kSsimKernels;
const SsimKernels kSsimKernels{ESVR_KERNEL_NAME, sumTaps, sumRows, multiply};

}  // namespace esvr::ESVR_KERNEL_NAMESPACE
