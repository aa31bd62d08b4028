#pragma once
/// Sums of ellipsoids: the kernel that all ellipsoids of a sum share, the ellipsoids, and the record of the fit
/// that made them.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "esvr/volume.h"

#if defined(__CUDACC__)
#define ESVR_HD __host__ __device__
#else
#define ESVR_HD
#endif

namespace esvr {

// The kernel family phi of an ellipsoid. The code is compiled for host and device.
//
//     phi(m) = ((1 + E) / (E + e^m) - eps) / (1 - eps)   for m < cutoff = ln((1 + E) / eps - E)
//     phi(m) = 0                                         otherwise
//
//     E = e^kappa,   m = | S^-1 R^T (x - mu) |^2
//
// kappa is the edge of the kernel. kappa = k gives the paper's sigmoid ellipsoid
// sigma(k (1 - q)) / sigma(k) with m = k q (paper, eq. 5, section 3.1); our scales are then
// sqrt(k) times smaller than the paper's. kappa -> -inf gives the Gaussian e^-m. The shift by eps
// makes phi continuous at the end of its support. The paper's own kernel jumps there;
// KernelForm::kPaper keeps it for reproduction.
//
// The evaluation multiplies both terms of the fraction by e^-s with s = max(kappa, 0), so that no
// kappa from -1e4 to 1e4 causes an overflow:
//
//     (1 + E) / (E + e^m) = A / (B + e^(m - s)),   A = e^-s + e^(kappa - s),   B = e^(kappa - s)

enum class KernelForm {
  kContinuous = 0,  ///< shifted by eps; phi is zero at the end of its support
  /// No shift. For k = 5 the support ends at q = 1.42^2 (paper, section 5). For another k it ends
  /// where phi has the same value; the paper adjusts its cutoff too, but does not say how.
  kPaper = 1
};

/// The parameters of a kernel that a file stores.
struct Kernel {
  static constexpr float kDefaultEpsilon = 0.006f;  ///< the paper's kernel at its cutoff, rounded
  static constexpr float kPaperK = 5.0f;            ///< the paper's sharpness k
  static constexpr float kPaperCutoff = 1.42f;      ///< its support radius, in the paper's scales

  KernelForm form = KernelForm::kContinuous;
  float kappa = 2.0f;
  float epsilon = kDefaultEpsilon;
  friend bool operator==(const Kernel&, const Kernel&) = default;
};

/// Constants of one kernel, computed in float64 and rounded once.
template <class Real>
struct KernelConstants {
  Real shift;      ///< s
  Real numerator;  ///< A / (1 - eps)
  Real plateau;    ///< B
  Real base;       ///< eps / (1 - eps), which is subtracted from the quotient
  /// (1 - eps) B / A, which times the quotient Q = phi + base is B / (B + y). Hence
  /// phi' = Q (Q slope - 1), and the derivative by kappa is slope Q (1 - phi) (docs/math.md).
  Real slope;
  Real cutoff;  ///< m at the end of the support
};

/// The value of the paper's kernel at the end of its support.
ESVR_HD inline double paperEnd() {
  const double k = Kernel::kPaperK, q = double(Kernel::kPaperCutoff) * Kernel::kPaperCutoff;
  return (1.0 + std::exp(-k)) / (1.0 + std::exp(k * (q - 1.0)));
}

template <class Real>
ESVR_HD KernelConstants<Real> kernelConstants(const Kernel& kernel, double kappa) {
  const bool paper = kernel.form == KernelForm::kPaper;
  const double s = kappa > 0.0 ? kappa : 0.0;
  const double b = std::exp(kappa - s);
  const double a = std::exp(-s) + b;
  const double eps = paper ? 0.0 : double(kernel.epsilon);
  const double norm = 1.0 / (1.0 - eps);
  const double cutoff = s + std::log(a / (paper ? paperEnd() : eps) - b);
  return {Real(s), Real(a * norm), Real(b), Real(eps * norm), Real(b / (a * norm)), Real(cutoff)};
}
template <class Real>
ESVR_HD KernelConstants<Real> kernelConstants(const Kernel& kernel) {
  return kernelConstants<Real>(kernel, double(kernel.kappa));
}

/// The value of phi, which is 0 for m >= c.cutoff. \param m  not negative
template <class Real>
ESVR_HD inline Real kernelPhi(const KernelConstants<Real>& c, Real m) {
  if (!(m < c.cutoff)) return Real(0);
  return c.numerator / (c.plateau + std::exp(m - c.shift)) - c.base;
}

/// The half width of an ellipsoid: the radius at which phi is 1/2, in units of the scales.
struct KernelWidth {
  double m;            ///< the half width squared: phi(m) = 1/2
  double logMByKappa;  ///< d ln m / d kappa
};

/// \param c  constants of a continuous kernel
inline KernelWidth kernelWidth(const KernelConstants<double>& c) {
  const double half = 0.5 + c.base;  // the quotient where phi is 1/2
  const double y = c.numerator / half - c.plateau;
  const double m = c.shift + std::log(y);
  // m = ln((1 + E) / h - E) with h = half (1 - eps), so
  // dm / dkappa = E (1 / h - 1) / ((1 + E) / h - E)
  const double h = half / (1.0 + c.base);
  return {m, c.plateau * (1.0 / h - 1.0) / y / m};
}

/// Radius of the support in units of the scales: x is inside if |S^-1 R^T (x - mu)| < radius.
template <class Real>
ESVR_HD inline Real supportRadius(const KernelConstants<Real>& c) {
  return std::sqrt(c.cutoff);
}

// Ellipsoids as a structure of arrays, the form in which a fit returns them, a file stores them
// and a renderer draws them.

/// n ellipsoids. Ellipsoid i adds intensity[i] * phi(m) to the field, where
/// m = | S^-1 R^T (x - center) |^2, S = diag(exp(logScale)) and R is the rotation's matrix (paper,
/// section 3.1; phi is in ellipsoids.h). Sigma = R S^2 R^T is never formed.
struct Ellipsoids {
  std::array<std::vector<float>, 3> center;  ///< x, y, z in voxels, relative to the chunk's origin
  std::array<std::vector<float>, 3> logScale;  ///< natural logarithms of the scales in voxels
  std::array<std::vector<float>, 4> rotation;  ///< unit quaternion w, x, y, z
  std::vector<float> intensity;                ///< value units of the grid, of either sign
  std::vector<float> kappa;  ///< edge of each ellipsoid; empty if all share the kernel's

  [[nodiscard]] std::size_t size() const { return intensity.size(); }
  void resize(std::size_t n, bool perEllipsoidKappa = false);
  friend bool operator==(const Ellipsoids&, const Ellipsoids&) = default;
};

/// The largest magnitude of a logScale that files hold. A scale of e^32 voxels is larger than the
/// index space; products of three such scales are far from the ends of float64.
inline constexpr float kMaxLogScale = 32.0f;

/// \throws std::logic_error  the arrays differ in length
void checkInvariants(const Ellipsoids& e);

/// True if every parameter is finite and every quaternion has unit length to within 1e-5.
[[nodiscard]] bool wellFormed(const Ellipsoids& e);

/// Ellipsoids whose centers are relative to one integer origin. A grid that is at most
/// kChunkExtent voxels wide has one chunk; float32 centers are then exact to 2^-12 voxel.
struct Chunk {
  Coord origin;  ///< index coordinates of the voxel at (0, 0, 0) in the centers' coordinates
  Ellipsoids ellipsoids;
};
inline constexpr std::int32_t kChunkExtent = 4096;

/// A sum of ellipsoids: V(x) = background + sum over chunks and ellipsoids. Voxel (i, j, k) is
/// sampled at x = (i, j, k).
struct Field {
  float background = 0.0f;
  Kernel kernel;  ///< kernel of all ellipsoids; kernel.kappa is used if Ellipsoids::kappa is empty
  std::vector<Chunk> chunks;

  [[nodiscard]] std::size_t ellipsoidCount() const;
};

// The curve of a fit: its error after a number of iterations. Files store it without times;
// FitResult and reports also have the times.

/// The state of a fit after an iteration. It depends on the input, the options, the seed and the
/// device only, so that a file that stores it is reproducible.
struct CurvePoint {
  std::uint32_t iteration = 0;
  std::uint64_t ellipsoids = 0;
  double psnrBox = 0.0;     ///< dB over the box; the peak is the source's (peakOf)
  double psnrActive = 0.0;  ///< dB over the active voxels
  double maxError = 0.0;    ///< largest absolute error, in value units
  friend bool operator==(const CurvePoint&, const CurvePoint&) = default;
};

/// A curve point with the time at which it was reached.
struct TimedCurvePoint : CurvePoint {
  double seconds = 0.0;  ///< wall-clock time since the fit began
};

/// The points as a file stores them: without their times, and with PSNRs that are rounded to float.
[[nodiscard]] inline std::vector<CurvePoint> withoutTimes(
    const std::vector<TimedCurvePoint>& curve) {
  std::vector<CurvePoint> points(curve.begin(), curve.end());
  for (CurvePoint& point : points) {
    point.psnrBox = float(point.psnrBox);
    point.psnrActive = float(point.psnrActive);
  }
  return points;
}

}  // namespace esvr
