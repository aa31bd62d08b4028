#include "codec/sorted_axes.h"

#include <cmath>
#include <utility>

namespace esvr {
namespace {

using Quaternion = std::array<double, 4>;

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

/// Exchanges two neighbouring axes by a quarter turn about the third.
void exchange(SortedAxes& axes, std::size_t first) {
  const double h = std::sqrt(0.5);
  const Quaternion quarter = first == 0 ? Quaternion{h, 0, 0, h} : Quaternion{h, h, 0, 0};
  std::swap(axes.logScale[first], axes.logScale[first + 1]);
  axes.rotation = product(axes.rotation, quarter);
}

void takeLargestW(Quaternion& q) {
  constexpr Quaternion kHalfTurns[] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  Quaternion best = q;
  for (const Quaternion& turn : kHalfTurns)
    if (const auto turned = product(q, turn); std::abs(turned[0]) > std::abs(best[0]))
      best = turned;
  const double sign = best[0] < 0.0 ? -1.0 : 1.0;
  for (double& c : best) c *= sign;
  q = best;
}

}  // namespace

SortedAxes sortedAxes(const Ellipsoids& e, std::size_t i) {
  SortedAxes axes{{e.logScale[0][i], e.logScale[1][i], e.logScale[2][i]},
                  {e.rotation[0][i], e.rotation[1][i], e.rotation[2][i], e.rotation[3][i]}};
  if (axes.logScale[0] < axes.logScale[1]) exchange(axes, 0);
  if (axes.logScale[1] < axes.logScale[2]) exchange(axes, 1);
  if (axes.logScale[0] < axes.logScale[1]) exchange(axes, 0);
  takeLargestW(axes.rotation);
  return axes;
}

}  // namespace esvr
