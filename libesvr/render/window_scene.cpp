#include "render/window_scene.h"

#include <cmath>

#include "render/ellipsoid_view.h"

namespace esvr {
namespace {

/// The three columns of L = S^-1 R^T.
using Columns = std::array<Vec3, 3>;

Columns unitColumns(const PackedEllipsoid& e) {
  const Matrix3 R = unitRotation(e);
  Columns columns;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) columns[c][r] = 1.0 / double(e.scale[r]) * R[3 * c + r];
  return columns;
}

Vec3 without(const Vec3& v, const Vec3& direction, double along) {
  return difference(v, scaled(direction, along));
}

/// U by Gram-Schmidt orthogonalisation, in the order column, row, slab.
WindowOrder orderOf(const Columns& l, int slabAxis, double radius) {
  const WindowAxes axes = axesOfSlabs(slabAxis);
  const Vec3 &column = l[axes.column], &row = l[axes.row], &slab = l[axes.slab];
  const double cc = length(column);
  const Vec3 q0 = scaled(column, 1.0 / cc);
  const double cr = inner(q0, row), cs = inner(q0, slab);
  const Vec3 rowLeft = without(row, q0, cr);
  const double rr = length(rowLeft);
  const Vec3 q1 = scaled(rowLeft, 1.0 / rr);
  const double rs = inner(q1, slab);
  const double ss = length(without(without(slab, q0, cs), q1, rs));
  return {float(cc), float(cr), float(cs), float(rr), float(rs), float(ss), float(radius / ss)};
}

}  // namespace

WindowForm windowForm(const PackedEllipsoid& e, const RayKernel& kernel) {
  const Columns columns = unitColumns(e);
  WindowForm f{};
  for (int a = 0; a < 3; ++a) {
    f.center[a] = e.center[a];
    f.order[a] = orderOf(columns, a, std::sqrt(double(kernel.cutoff)));
  }
  f.chunk = e.chunk;
  f.kernel = {e.intensity * kernel.numerator,
              e.intensity * kernel.base,
              kernel.plateau,
              kernel.shift,
              kernel.cutoff,
              std::abs(e.intensity)};
  return f;
}

std::vector<WindowForm> windowForms(const Field& field) {
  const auto ellipsoids = packed(field);
  const auto kernels = rayKernels(field);
  std::vector<WindowForm> forms;
  forms.reserve(ellipsoids.size());
  for (std::size_t i = 0; i < ellipsoids.size(); ++i)
    forms.push_back(windowForm(ellipsoids[i], kernels[kernels.size() == 1 ? 0 : i]));
  return forms;
}

}  // namespace esvr
