#include "fit/export_field.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "core/parallel.h"
#include "fit/frame.h"

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

}  // namespace esvr
