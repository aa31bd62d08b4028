#include "esvr/ellipsoids.h"

#include <algorithm>
#include <stdexcept>

namespace esvr {
namespace {

constexpr float kUnitTolerance = 1e-5f;  // float32 normalisation has an error of 2e-7

bool allFinite(const std::vector<float>& v) {
  return std::all_of(v.begin(), v.end(), [](float x) { return std::isfinite(x); });
}

template <std::size_t N>
bool allFinite(const std::array<std::vector<float>, N>& arrays) {
  return std::all_of(arrays.begin(), arrays.end(), [](const auto& v) { return allFinite(v); });
}

template <std::size_t N>
bool allOfSize(const std::array<std::vector<float>, N>& arrays, std::size_t n) {
  return std::all_of(arrays.begin(), arrays.end(), [n](const auto& v) { return v.size() == n; });
}

}  // namespace

void Ellipsoids::resize(std::size_t n, bool perEllipsoidKappa) {
  for (auto& v : center) v.resize(n);
  for (auto& v : logScale) v.resize(n);
  for (auto& v : rotation) v.resize(n);
  intensity.resize(n);
  kappa.resize(perEllipsoidKappa ? n : 0);
}

void checkInvariants(const Ellipsoids& e) {
  const std::size_t n = e.size();
  const bool kappaFits = e.kappa.empty() || e.kappa.size() == n;
  if (!allOfSize(e.center, n) || !allOfSize(e.logScale, n) || !allOfSize(e.rotation, n) ||
      !kappaFits)
    throw std::logic_error("Ellipsoids: arrays of different length");
}

bool wellFormed(const Ellipsoids& e) {
  if (!allFinite(e.center) || !allFinite(e.logScale) || !allFinite(e.rotation)) return false;
  if (!allFinite(e.intensity) || !allFinite(e.kappa)) return false;
  for (std::size_t i = 0; i < e.size(); ++i) {
    float norm2 = 0.0f;
    for (const auto& q : e.rotation) norm2 += q[i] * q[i];
    if (std::abs(std::sqrt(norm2) - 1.0f) > kUnitTolerance) return false;
  }
  return true;
}

std::size_t Field::ellipsoidCount() const {
  std::size_t n = 0;
  for (const auto& chunk : chunks) n += chunk.ellipsoids.size();
  return n;
}

}  // namespace esvr
