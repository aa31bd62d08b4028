#pragma once
/// Predicts numbers by a weighted sum of others. The weights are those of the least squared error
/// over the numbers before, which both a writer and a reader know.

#include <array>
#include <cmath>
#include <cstddef>

namespace esvr::codec {

/// All results are computed in float64 with +, -, *, / and square roots in a fixed order, so that
/// every machine gets the same bits. The file that includes this header must be compiled without
/// contraction to fused operations.
/// \tparam kCount  number of terms of a sum
template <std::size_t kCount>
class LeastSquares {
 public:
  using Terms = std::array<double, kCount>;

  /// \param first  weights before anything was learned
  explicit LeastSquares(const Terms& first) : weights_(first) {
    for (std::size_t i = 0; i < kCount; ++i) {
      products_[i][i] = kRidge;
      targets_[i] = kRidge * first[i];
    }
  }

  [[nodiscard]] double predict(const Terms& terms) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < kCount; ++i) sum += weights_[i] * terms[i];
    return sum;
  }

  void learn(const Terms& terms, double target) {
    for (std::size_t i = 0; i < kCount; ++i) {
      for (std::size_t j = 0; j <= i; ++j) products_[i][j] += terms[i] * terms[j];
      targets_[i] += terms[i] * target;
    }
  }

  /// Computes the weights by a Cholesky decomposition. They stay as they are if the products are
  /// singular or not finite.
  void solve() {
    std::array<Terms, kCount> lower{};
    for (std::size_t i = 0; i < kCount; ++i) {
      for (std::size_t j = 0; j < i; ++j) lower[i][j] = rest(lower, i, j) / lower[j][j];
      const double pivot = rest(lower, i, i);
      if (!(pivot > kLeastPivot * products_[i][i] && std::isfinite(pivot))) return;
      lower[i][i] = std::sqrt(pivot);
    }
    substitute(lower);
  }

  /// Makes what was learned so far count less.
  void fade() {
    for (std::size_t i = 0; i < kCount; ++i) {
      for (double& product : products_[i]) product *= kFade;
      targets_[i] *= kFade;
    }
  }

 private:
  static constexpr double kRidge = 1.0;  // weight of the first weights, in squared codes
  static constexpr double kFade = 0.98;
  static constexpr double kLeastPivot = 1e-12;

  [[nodiscard]] double rest(const std::array<Terms, kCount>& lower, std::size_t i,
                            std::size_t j) const {
    double sum = products_[i][j];
    for (std::size_t k = 0; k < j; ++k) sum -= lower[i][k] * lower[j][k];
    return sum;
  }

  void substitute(const std::array<Terms, kCount>& lower) {
    Terms half{};
    for (std::size_t i = 0; i < kCount; ++i) {
      double sum = targets_[i];
      for (std::size_t k = 0; k < i; ++k) sum -= lower[i][k] * half[k];
      half[i] = sum / lower[i][i];
    }
    for (std::size_t i = kCount; i-- > 0;) {
      double sum = half[i];
      for (std::size_t k = i + 1; k < kCount; ++k) sum -= lower[k][i] * weights_[k];
      weights_[i] = sum / lower[i][i];
    }
  }

  std::array<Terms, kCount> products_{};  // symmetric; only the lower half is kept
  Terms targets_{}, weights_;
};

}  // namespace esvr::codec
