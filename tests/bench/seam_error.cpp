// Measures the error of a fit in chunks near the planes between chunks and elsewhere:
//
//     seam_error FILE.vdb OUT.esvr CHUNKS [ONE.esvr]
//
// OUT.esvr was fitted in CHUNKS chunks, and ONE.esvr in one. The program prints the PSNR over the
// active voxels within four voxels of a plane, and over the others.

#include <tbb/combinable.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <string>

#include "core/axes.h"
#include "core/brick_index.h"
#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "fit/chunks/divide_bricks.h"

namespace {

using namespace esvr;

constexpr std::int64_t kNear = 4;  // voxels

/// The chunks of a fit on a GPU, whose bricks are halved until there are enough chunks.
std::vector<BrickChunk> divided(const SparseVolume& volume, std::size_t count) {
  std::size_t most = volume.brickCount();
  auto chunks = divideBricks(volume, most);
  while (chunks.size() < count && most > 1) chunks = divideBricks(volume, most /= 2);
  if (chunks.size() != count) throw std::runtime_error("the volume has no such division");
  return chunks;
}

bool isNearSeam(Coord voxel, const Box& bricks) {
  for (const auto axis : kAxes) {
    const std::int64_t low = std::int64_t{bricks.min.*axis} * kBrickSide,
                       high = (std::int64_t{bricks.max.*axis} + 1) * kBrickSide;
    if (voxel.*axis < low + kNear || voxel.*axis >= high - kNear) return true;
  }
  return false;
}

struct Squares {
  double sum[2] = {}, voxels[2] = {};  ///< away from planes, and near them
  Squares operator+(const Squares& o) const {
    return {{sum[0] + o.sum[0], sum[1] + o.sum[1]},
            {voxels[0] + o.voxels[0], voxels[1] + o.voxels[1]}};
  }
};

Squares squaresOf(const SparseVolume& source, const SparseVolume& found,
                  const std::vector<BrickChunk>& chunks) {
  tbb::combinable<Squares> parts;
  for (const BrickChunk& chunk : chunks)
    tbb::parallel_for(std::size_t{0}, chunk.bricks.size(), [&](std::size_t n) {
      const std::uint32_t b = chunk.bricks[n];
      const Coord corner = source.bricks[b] * kBrickSide;
      Squares& part = parts.local();
      for (int v = 0; v < kBrickVoxels; ++v) {
        if (!source.active[b].test(v)) continue;
        const Coord at = corner + voxelLocal(v);
        const double difference =
            double(source.brickValues(b)[v]) - double(valueAt(found, source.origin + at));
        const int near = isNearSeam(at, chunk.box) ? 1 : 0;
        part.sum[near] += difference * difference;
        part.voxels[near] += 1.0;
      }
    });
  return parts.combine(std::plus<Squares>());
}

void print(const std::string& file, const Squares& squares, double peak) {
  const auto psnr = [&](int n) {
    return 10.0 * std::log10(peak * peak * squares.voxels[n] / squares.sum[n]);
  };
  std::printf("%s: %.2f dB near planes (%.0f voxels), %.2f dB elsewhere (%.0f voxels)\n",
              file.c_str(), psnr(1), squares.voxels[1], psnr(0), squares.voxels[0]);
}

void run(int argc, char** argv) {
  const SparseVolume source =
      readGrid(argv[1], inspectVdb(argv[1]).grids.front().uniqueName, {}).volume;
  const auto chunks = divided(source, std::stoul(argv[3]));
  for (int n = 2; n < argc; n += 2) {
    const SparseVolume found = decodeGrid(readEsvr(argv[n]).grids.front());
    print(argv[n], squaresOf(source, found, chunks), peakOf(source));
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 4 || argc > 5) return 2;
  run(argc, argv);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
