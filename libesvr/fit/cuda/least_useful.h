#pragma once
/// Which ellipsoids to give up where memory is out.

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

namespace esvr::cuda {

/// \return the places of all but the `dropped` lowest values, in increasing order; of equal values
///         the first are dropped
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
