#include "field/support.h"

namespace esvr {

Support makeSupport(const std::array<double, 3>& center, const Matrix3& L, double radius,
                    double slack) {
  Support s{center, L, radius, slack, {}};
  const Matrix3 F = inverse(L);
  for (int a = 0; a < 3; ++a)
    s.half[a] = radius * std::sqrt(F[3 * a] * F[3 * a] + F[3 * a + 1] * F[3 * a + 1] +
                                   F[3 * a + 2] * F[3 * a + 2]) +
                slack;
  return s;
}

}  // namespace esvr
