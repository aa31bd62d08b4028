#include "field/line_form.h"

#include <cmath>

namespace esvr {

Matrix3 unitFrame(const Ellipsoids& e, std::size_t i) {
  const Quaternion q{e.rotation[0][i], e.rotation[1][i], e.rotation[2][i], e.rotation[3][i]};
  const Matrix3 R = rotationOf(normalised(q));
  Matrix3 L;
  for (int r = 0; r < 3; ++r) {
    const double inv = std::exp(-double(e.logScale[r][i]));
    for (int c = 0; c < 3; ++c) L[3 * r + c] = inv * R[3 * c + r];
  }
  return L;
}

}  // namespace esvr
