#include "splats/gaussian.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace esvr::splats {
namespace {

constexpr double kPi = std::numbers::pi;

Quaternion asQuaternion(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  return {sign * q.w(), sign * q.x(), sign * q.y(), sign * q.z()};
}

Eigen::Matrix3d asEigen(const Matrix3& m) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m.data());
}

}  // namespace

KernelGaussian gaussianOf(const Kernel& kernel, double kappa) {
  constexpr int kIntervals = 512;  // of Simpson's rule; the kernel is smooth up to its end
  const auto c = kernelConstants<double>(kernel, kappa);
  const double step = supportRadius(c) / kIntervals;
  double second = 0.0, fourth = 0.0;
  for (int i = 1; i < kIntervals; ++i) {
    const double r = i * step, weight = i % 2 == 1 ? 4.0 : 2.0;
    const double phi = weight * kernelPhi(c, r * r);
    second += phi * r * r;
    fourth += phi * r * r * r * r;
  }
  return {std::sqrt(fourth / second / 3.0), 4.0 * kPi * second * step / 3.0};
}

Kernel gaussianKernel() {
  constexpr float kAlmostMinusInfinity = -1e4f, kCut = 1e-4f;
  return {KernelForm::kContinuous, kAlmostMinusInfinity, kCut};
}

double gaussianVolume() {
  const double cut = double(gaussianKernel().epsilon), radius = std::sqrt(-std::log(cut));
  const double whole = std::pow(kPi, 1.5) * std::erf(radius) - 2.0 * kPi * radius * cut;
  const double base = 4.0 / 3.0 * kPi * radius * radius * radius * cut;
  return 2.0 * std::numbers::sqrt2 * (whole - base) / (1.0 - cut);
}

double meanShadow(Sizes halfAxes) {
  constexpr double kRound = 1e-4;  // below this, the difference of the axes would cancel
  std::sort(halfAxes.begin(), halfAxes.end(), std::greater<>());
  const auto [a, b, c] = halfAxes;
  if (a - c < kRound * a) return (a * b + a * c + b * c) / 3.0;
  const double cosine = c / a, sine = std::sqrt((1.0 - cosine) * (1.0 + cosine));
  const double k = std::min(1.0, a / b * std::sqrt((b - c) * (b + c) / ((a - c) * (a + c))));
  const double angle = std::acos(cosine);
  const double mixed = std::ellint_2(k, angle) * sine * sine +
                       (c > 0.0 ? std::ellint_1(k, angle) * cosine * cosine : 0.0);
  return (c * c + a * b / sine * mixed) / 2.0;
}

double depthOfAlpha(double alpha) {
  constexpr double kHalf = 0.5, kEnough = 1e-17;
  if (alpha > kHalf) {
    const double rest = 1.0 - alpha;
    const double logs = rest > 0.0 ? std::log(alpha) * std::log(rest) : 0.0;
    return kPi * kPi / 6.0 - logs - depthOfAlpha(rest);
  }
  double sum = 0.0, power = alpha;
  for (double n = 1.0; power > kEnough * alpha; ++n, power *= alpha) sum += power / (n * n);
  return sum;
}

Quaternion quaternionOf(const Matrix3& rotation) {
  return asQuaternion(Eigen::Quaterniond(asEigen(rotation)));
}

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return asQuaternion(Eigen::Quaterniond(a[0], a[1], a[2], a[3]) *
                      Eigen::Quaterniond(b[0], b[1], b[2], b[3]));
}

PrincipalGaussian principalAxesOf(const Matrix3& columns) {
  // The squares lose half of the digits of float64, which leaves enough for sizes down to a millionth.
  const Eigen::Matrix3d m = asEigen(columns);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(m * m.transpose());
  Eigen::Matrix3d axes = solver.eigenvectors().rowwise().reverse();
  if (axes.determinant() < 0.0) axes.col(2) = -axes.col(2);
  const Eigen::Vector3d squares = solver.eigenvalues().cwiseMax(0.0);
  return {asQuaternion(Eigen::Quaterniond(axes)),
          {std::sqrt(squares[2]), std::sqrt(squares[1]), std::sqrt(squares[0])}};
}

}  // namespace esvr::splats
