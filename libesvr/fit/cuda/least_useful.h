#pragma once
/// Chooses the ellipsoids that are kept when memory runs out.

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

namespace esvr::cuda {

/// \return the places of all values but the `dropped` lowest ones, in increasing order. If values
///         are equal, the first ones are dropped.
[[nodiscard]] inline std::vector<std::size_t> allButLowest(std::span<const double> values,
                                                           std::size_t dropped) {
  std::vector<std::size_t> places(values.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  std::stable_sort(places.begin(), places.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  places.erase(places.begin(), places.begin() + std::ptrdiff_t(std::min(dropped, places.size())));
  std::sort(places.begin(), places.end());
  return places;
}

}  // namespace esvr::cuda
