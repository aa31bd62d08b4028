#include "esvr/field.h"
#include "field/line_form.h"

namespace esvr {
namespace {

double squaredDistance(const Ellipsoids& e, std::size_t i, const double d[3]) {
  const Matrix3 L = unitFrame(e, i);
  double m = 0.0;
  for (int r = 0; r < 3; ++r) {
    const double u = L[3 * r] * d[0] + L[3 * r + 1] * d[1] + L[3 * r + 2] * d[2];
    m += u * u;
  }
  return m;
}

}  // namespace

double evaluateReference(const Field& field, Coord voxel) {
  double value = field.background;
  for (const Chunk& chunk : field.chunks) {
    const Ellipsoids& e = chunk.ellipsoids;
    for (std::size_t i = 0; i < e.size(); ++i) {
      const double d[3] = {double(voxel.x) - chunk.origin.x - e.center[0][i],
                           double(voxel.y) - chunk.origin.y - e.center[1][i],
                           double(voxel.z) - chunk.origin.z - e.center[2][i]};
      const double kappa = e.kappa.empty() ? double(field.kernel.kappa) : double(e.kappa[i]);
      const auto k = kernelConstants<double>(field.kernel, kappa);
      value += double(e.intensity[i]) * kernelPhi(k, squaredDistance(e, i, d));
    }
  }
  return value;
}

}  // namespace esvr
