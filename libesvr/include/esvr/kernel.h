#pragma once
/// The kernel family phi of an ellipsoid. The code is compiled for host and device.
///
///     phi(m) = ((1 + E) / (E + e^m) - eps) / (1 - eps)   for m < cutoff = ln((1 + E) / eps - E)
///     phi(m) = 0                                         otherwise
///
///     E = e^kappa,   m = | S^-1 R^T (x - mu) |^2
///
/// kappa is the edge of the kernel. kappa = k gives the paper's sigmoid ellipsoid
/// sigma(k (1 - q)) / sigma(k) with m = k q (paper, eq. 5, section 3.1); our scales are then
/// sqrt(k) times smaller than the paper's. kappa -> -inf gives the Gaussian e^-m. The shift by eps
/// makes phi continuous at the end of its support. The paper's own kernel jumps there;
/// KernelForm::kPaper keeps it for reproduction.
///
/// The evaluation multiplies both terms of the fraction by e^-s with s = max(kappa, 0), so that no
/// kappa from -1e4 to 1e4 causes an overflow:
///
///     (1 + E) / (E + e^m) = A / (B + e^(m - s)),   A = e^-s + e^(kappa - s),   B = e^(kappa - s)

#include <cmath>

#if defined(__CUDACC__)
#define ESVR_HD __host__ __device__
#else
#define ESVR_HD
#endif

namespace esvr {

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

}  // namespace esvr
