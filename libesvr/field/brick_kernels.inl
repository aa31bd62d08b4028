// The body of brick_kernels_*.cpp, which compile it for different instruction sets. No inline
// function of a library may be called here: the linker keeps one copy of such a function for the
// whole program, and that could be the one compiled for AVX-512.
//
// The including file defines ESVR_KERNEL_NAMESPACE, ESVR_KERNEL_LANES (8 for one row of a brick, 16
// for two rows) and ESVR_KERNEL_NATIVE (floats in a register: ESVR_KERNEL_LANES or half of it).

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
inline Vec& operator+=(Vec& a, Vec b) { return a = a + b; }
inline Vec& operator+=(Vec& a, float b) { return a = a + b; }
#endif

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

alignas(64) constexpr float kLaneZ[16] = {0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7};
alignas(64) constexpr float kLaneY[16] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};

/// Sums the lanes. The order of the additions is fixed for each instruction set.
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

/// e^x for x in [-87, 88], and e^-87 for smaller x. It is computed as 2^n e^r with x = n ln 2 + r
/// and |r| <= ln 2 / 2. For e^r it uses a polynomial of degree 6, whose coefficients were fitted at
/// Chebyshev nodes. The error is at most 1.5 units in the last place.
inline Native expApprox(Native x) {
  constexpr float kLog2e = 1.44269504f, kLn2High = 0.693359375f, kLn2Low = -2.12194440e-4f;
  constexpr float kRound =
      12582912.0f;  // 1.5 * 2^23: adding it rounds to an integer in the low bits
  constexpr Native kLowest = Native{} - 87.0f;
  x = x > kLowest ? x : kLowest;
  const Native shifted = x * kLog2e + kRound;
  const Native n = shifted - kRound;
  const Native r = (x - n * kLn2High) - n * kLn2Low;
  Native p = r * 1.39263e-3f + 8.35726e-3f;
  p = p * r + 4.166655e-2f;
  p = p * r + 1.6666631e-1f;
  p = p * r + 0.5f;
  p = p * r + 1.0f;
  p = p * r + 1.0f;
  return (Native)((NativeInt)p + ((NativeInt)shifted << 23));
}

struct Rows {
  int begin, end;
};

inline int clampRow(float y) { return y < 0.0f ? 0 : (y > 8.0f ? 8 : int(y)); }

/// The rows of slice dx that the support can touch. The half width is widened by a hundredth of a
/// voxel because of rounding. Rows outside the support contribute exactly 0.
inline Rows rowsOfSlice(const LineForm& f, float dx, float cy) {
  const float q = dx / f.halfX;
  const float left = 1.0f - q * q;
  const float half = f.halfYx * __builtin_sqrtf(left > 0.0f ? left : 0.0f) + 0.01f;
  const float mid = cy + f.slopeYx * dx;
  const int begin = clampRow(mid - half + 1.0f);
  const int end = clampRow(mid + half + 1.0f);
  return {begin & ~(kRows - 1), (end + kRows - 1) & ~(kRows - 1)};
}

inline Rows slices(const LineForm& f, float cx) {
  return {clampRow(cx - f.halfX - 0.01f + 1.0f), clampRow(cx + f.halfX + 0.01f + 1.0f)};
}

/// An ellipsoid in the frame of a brick.
struct Local {
  float cx, cy;
  Vec dz;
  Vec pz[3];  // pz * dz
};

inline Local localise(const LineForm& f, const float corner[3]) {
  Local l;
  l.cx = f.center[0] - corner[0];
  l.cy = f.center[1] - corner[1];
  l.dz = load(kLaneZ) - (f.center[2] - corner[2]);
  for (int j = 0; j < 3; ++j) l.pz[j] = l.dz * f.pz[j];
  return l;
}

/// The value of t in row y = 0.
inline Vec firstDistance(const LineForm& f, const Local& l, float dx) {
  return distanceAlong(f, load(kLaneY), l.cy, dx, l.dz);
}

inline Vec phiOf(const KernelConstants<float>& k, Vec m) {
  return each(
      [&k](Native v) {
        const auto inside = v < k.cutoff;
        const Native clamped = inside ? v : Native{} + k.cutoff;
        const Native phi = k.numerator / (k.plateau + expApprox(clamped - k.shift)) - k.base;
        return inside ? phi : Native{};
      },
      m);
}

/// residual * (phi + base) inside the support, and 0 outside, where phi is 0.
inline Vec weightedQuotient(const KernelConstants<float>& k, Vec phi, Vec residual) {
  return each([&k](Native p, Native r) { return p > 0.0f ? r * (p + k.base) : Native{}; }, phi,
              residual);
}

template <bool kTape>
inline void run(const LineForm& f, const float corner[3], const KernelConstants<float>& k,
                float* sum, PairTape* tape) {
  const Local l = localise(f, corner);
  const Rows xs = slices(f, l.cx);
  float* out = kTape ? tape->phi : nullptr;
  for (int x = xs.begin; x < xs.end; ++x) {
    const float dx = float(x) - l.cx;
    const Rows ys = rowsOfSlice(f, dx, l.cy);
    const Vec mMin = closestSquared(f, dx, l.pz);
    Vec t = firstDistance(f, l, dx) + float(ys.begin);
    float* row = sum + x * 64 + ys.begin * 8;
    for (int y = ys.begin; y < ys.end; y += kRows, row += kLanes, t += float(kRows)) {
      const Vec phi = phiOf(k, squaredAt(f, mMin, t));
      store(row, load(row) + f.intensity * phi);
      if constexpr (kTape) {
        store(out, phi);
        out += kLanes;
      }
    }
    if constexpr (kTape) {
      tape->yBegin[x] = (signed char)ys.begin;
      tape->yEnd[x] = (signed char)ys.end;
    }
  }
  if constexpr (kTape) {
    tape->xBegin = xs.begin;
    tape->xEnd = xs.end;
    tape->floats = int(out - tape->phi);
  }
}

void add(const LineForm& f, const float corner[3], const KernelConstants<float>& k, float* sum) {
  run<false>(f, corner, k, sum, nullptr);
}

void forward(const LineForm& f, const float corner[3], const KernelConstants<float>& k, float* sum,
             PairTape& tape) {
  run<true>(f, corner, k, sum, &tape);
}

/// Sums of a pair in each lane.
struct LaneSums {
  Vec s0, s0x, s0xx, s1, s1x, s2, rPhi, phi2, rEdge;
};

/// \param dz  distance of each lane's voxels along z
inline PairMoments momentsOf(const LaneSums& s, Vec dz) {
  return {sumLanes(s.s0x),          sumLanes(s.s0 * dz), sumLanes(s.s0xx), sumLanes(s.s0x * dz),
          sumLanes(s.s0 * dz * dz), sumLanes(s.s1),      sumLanes(s.s1x),  sumLanes(s.s1 * dz),
          sumLanes(s.s2),           sumLanes(s.rPhi),    sumLanes(s.phi2), sumLanes(s.rEdge)};
}

void backward(const LineForm& f, const float corner[3], const KernelConstants<float>& k,
              const float* r, const PairTape& tape, PairMoments& moments) {
  const Local l = localise(f, corner);
  Vec s0{}, s0x{}, s0xx{}, s1{}, s1x{}, s2{}, rPhi{}, phi2{}, rEdge{};
  const float slopeBase = k.slope * k.base - 1.0f;
  const float* in = tape.phi;
  for (int x = tape.xBegin; x < tape.xEnd; ++x) {
    const float dx = float(x) - l.cx;
    const int begin = tape.yBegin[x], end = tape.yEnd[x];
    Vec t = firstDistance(f, l, dx) + float(begin);
    const float* row = r + x * 64 + begin * 8;
    Vec w0{}, w1{};
    for (int y = begin; y < end; y += kRows, row += kLanes, in += kLanes, t += float(kRows)) {
      const Vec phi = load(in), g = load(row);
      const Vec rq = weightedQuotient(k, phi, g);
      const Vec w = rq * (phi * k.slope + slopeBase);  // r phi'
      const Vec wt = w * t;
      w0 += w;
      w1 += wt;
      s2 += wt * t;
      rPhi += g * phi;
      phi2 += phi * phi;
      rEdge += rq - rq * phi;
    }
    s0 += w0;
    s0x += w0 * dx;
    s0xx += w0 * (dx * dx);
    s1 += w1;
    s1x += w1 * dx;
  }
  moments = momentsOf({s0, s0x, s0xx, s1, s1x, s2, rPhi, phi2, rEdge}, l.dz);
}

/// Calls visit(phi, row) for every row of a tape in its order; `row` points to the row's values in
/// `values`.
template <class Value, class Visit>
inline void visitTape(const PairTape& tape, Value* values, Visit&& visit) {
  const float* phi = tape.phi;
  for (int x = tape.xBegin; x < tape.xEnd; ++x) {
    Value* row = values + x * 64 + tape.yBegin[x] * 8;
    for (int y = tape.yBegin[x]; y < tape.yEnd[x]; y += kRows, row += kLanes, phi += kLanes)
      visit(load(phi), row);
  }
}

void addTape(const PairTape& tape, float intensity, float* sum) {
  visitTape(tape, sum, [&](Vec phi, float* row) { store(row, load(row) + intensity * phi); });
}

void projectTape(const PairTape& tape, const float* r, PairProjection& projection) {
  Vec rPhi{}, phi2{};
  visitTape(tape, r, [&](Vec phi, const float* row) {
    rPhi += load(row) * phi;
    phi2 += phi * phi;
  });
  projection = {sumLanes(rPhi), sumLanes(phi2)};
}

void addPlaces(const LineForm& f, const float corner[3], const KernelConstants<float>& k,
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
const BrickKernels kKernels{ESVR_KERNEL_NAME, add, forward, backward, addTape, projectTape};
extern const AddPlaces kAddPlaces;
const AddPlaces kAddPlaces = addPlaces;
extern const SsimKernels kSsimKernels;
const SsimKernels kSsimKernels{ESVR_KERNEL_NAME, sumTaps, sumRows, multiply};

}  // namespace esvr::ESVR_KERNEL_NAMESPACE
