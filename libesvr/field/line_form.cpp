#include "field/line_form.h"

#include <cmath>

namespace esvr {

Matrix3 unitFrame(const Ellipsoids& e, std::size_t i) {
  double w = e.rotation[0][i], x = e.rotation[1][i], y = e.rotation[2][i], z = e.rotation[3][i];
  const double norm = 1.0 / std::sqrt(w * w + x * x + y * y + z * z);
  w *= norm, x *= norm, y *= norm, z *= norm;
  const Matrix3 R{1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                  2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                  2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  Matrix3 L;
  for (int r = 0; r < 3; ++r) {
    const double inv = std::exp(-double(e.logScale[r][i]));
    for (int c = 0; c < 3; ++c) L[3 * r + c] = inv * R[3 * c + r];
  }
  return L;
}

}  // namespace esvr
