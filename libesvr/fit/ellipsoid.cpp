#include "fit/ellipsoid.h"

#include <Eigen/Dense>
#include <map>

#include "core/parallel.h"

namespace esvr {
namespace {

void append(Ellipsoids& e, const Ellipsoid& p, const PrincipalAxes& axes, Coord frame,
            double scale) {
  const auto center = inFrame(p.center, frame);
  for (std::size_t a = 0; a < 3; ++a) {
    e.center[a].push_back(float(center[a]));
    e.logScale[a].push_back(float(std::log(axes.scale[a])));
  }
  for (std::size_t a = 0; a < 4; ++a) e.rotation[a].push_back(float(axes.rotation[a]));
  e.intensity.push_back(float(p.intensity / scale));
}

/// True if one frame holds all centers with their full precision. A center may lie before the origin.
bool fitInOneFrame(std::span<const Ellipsoid> ellipsoids) {
  return std::all_of(ellipsoids.begin(), ellipsoids.end(), [](const Ellipsoid& p) {
    return std::all_of(p.center.begin(), p.center.end(),
                       [](double c) { return std::abs(c) < double(kChunkExtent); });
  });
}

}  // namespace

PrincipalAxes principalAxes(const Matrix3& L) {
  using Eigen::Matrix3d;
  const Eigen::JacobiSVD<Matrix3d> svd(ellipsoid_math::asEigen(L), Eigen::ComputeFullV);
  const Eigen::Vector3d s = svd.singularValues();
  // The singular values of L decrease and the scales increase; the longest axis must come first.
  Matrix3d R = svd.matrixV().rowwise().reverse();
  if (R.determinant() < 0.0) R.col(2) = -R.col(2);
  Eigen::Quaterniond q(R);
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return {{1.0 / s[2], 1.0 / s[1], 1.0 / s[0]}, {q.w(), q.x(), q.y(), q.z()}};
}

Field exportField(std::span<const Ellipsoid> ellipsoids, const ExportFrame& frame) {
  std::vector<PrincipalAxes> axes(ellipsoids.size());
  parallelFor(std::size_t{0}, axes.size(),
              [&](std::size_t i) { axes[i] = principalAxes(ellipsoids[i].L); });
  const bool inOne = fitInOneFrame(ellipsoids);
  std::map<Coord, Ellipsoids> byChunk;
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    const Coord chunk = inOne ? Coord{} : frameOf(ellipsoids[i].center);
    Ellipsoids& stored = byChunk[chunk];
    append(stored, ellipsoids[i], axes[i], chunk, frame.scale);
    if (!frame.kappas.empty()) stored.kappa.push_back(float(frame.kappas[i]));
  }
  Field field;
  field.background = frame.background;
  field.kernel = frame.kernel;
  for (auto& [chunk, stored] : byChunk)
    field.chunks.push_back({frame.origin + chunk, std::move(stored)});
  return field;
}

std::vector<Ellipsoid> importField(const Field& field, Coord origin, double scale) {
  std::vector<Ellipsoid> all;
  all.reserve(field.ellipsoidCount());
  for (const auto& chunk : field.chunks) {
    const Ellipsoids& e = chunk.ellipsoids;
    const Coord frame = chunk.origin - origin;
    for (std::size_t i = 0; i < e.size(); ++i)
      all.push_back({{frame.x + double(e.center[0][i]), frame.y + double(e.center[1][i]),
                      frame.z + double(e.center[2][i])},
                     unitFrame(e, i),
                     e.intensity[i] * scale});
  }
  return all;
}

}  // namespace esvr
