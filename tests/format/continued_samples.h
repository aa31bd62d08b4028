#pragma once
/// Frames with one grid of ellipsoids that continue those of the previous frame.

#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include "codec/continued_frames.h"
#include "esvr/container.h"
#include "esvr/frame_coding.h"
#include "esvr/sequence_file.h"
#include "fit/volumes.h"

namespace esvr::test {

/// A grid of one chunk.
inline StoredGrid gridOf(QuantisedEllipsoids q) {
  StoredGrid grid;
  grid.descriptor.name = "density";
  grid.activeBox = {{0, 0, 0}, {63, 63, 63}};
  grid.activeVoxels = 1000;
  grid.valueMax = 1.0f;
  grid.field.chunks.push_back({{-8, 0, 16}, dequantise(q)});
  grid.quantised.push_back(std::move(q));
  return grid;
}

inline EsvrFile frameOf(StoredGrid grid) { return {{}, {std::move(grid)}}; }

/// Appends ellipsoids that continue none.
inline QuantisedEllipsoids withNew(QuantisedEllipsoids q, std::size_t count) {
  Change far{.motion = 20.0};
  std::vector<std::uint32_t> models(count);
  for (std::size_t i = 0; i < count; ++i) models[i] = std::uint32_t(i % q.size());
  QuantisedEllipsoids before = q;
  before.motion = {};
  LatticeChoice choice{q.lattice, std::vector<std::uint8_t>(count, q.precision[0])};
  std::vector<std::size_t> order;
  const QuantisedEllipsoids added = quantise(movedFrom(before, models, far), choice, order);
  const auto append = [](const auto& from, auto& to) {
    to.insert(to.end(), from.begin(), from.end());
  };
  for (std::size_t a = 0; a < 3; ++a) {
    append(added.position[a], q.position[a]);
    append(added.scale[a], q.scale[a]);
    append(added.rotation[a], q.rotation[a]);
  }
  append(added.precision, q.precision);
  append(added.intensity, q.intensity);
  return q;
}

/// The mask of a ball that moves along z by a voxel a frame.
inline StoredGrid withMask(StoredGrid grid, int frame) {
  const SparseVolume ball = volumeOf({-8, 0, 0}, 4, 0.0f, [&](Coord v) {
    return std::hypot(v.x - 6.0, v.y - 15.0, v.z - 12.0 - frame) < 9.0 ? 1.0f : 0.0f;
  });
  grid.topology = TopologyKind::kMask;
  for (std::size_t b = 0; b < ball.brickCount(); ++b) grid.bricks.push_back(ball.brickCorner(b));
  grid.mask = ball.active;
  return grid;
}

/// Thresholds for the blocks of 4^3 bricks, which change in every third brick from frame to frame.
inline StoredGrid withLevels(StoredGrid grid, int frame) {
  grid.topology = TopologyKind::kBlocks;
  grid.activeThreshold = 0.01f;
  for (std::int32_t n = 0; n < 64; ++n) {
    grid.bricks.push_back(Coord{n / 16 + frame / 2, n / 4 % 4, n % 4 - 2} * kBrickSide);
    const int change = n % 3 == 0 ? frame : 0;
    grid.levels.emplace_back().of.fill(std::uint8_t((n * 5 + change) % kLevelCount));
  }
  return grid;
}

/// The frame after another one, as a reader gets it.
inline EsvrFile appended(SequenceWriter& writer, std::int64_t number, const EsvrFile& frame,
                         const EsvrFile* previous) {
  auto bytes = encodeFrame(frame, previous);
  EsvrFile decoded = decodeFrame(bytes, "frame", {}, previous);
  writer.append(number, std::move(bytes));
  return decoded;
}

/// Writes the golden sequence of continued ellipsoids: a frame that stands alone, one with new
/// ellipsoids, one with other cells and finer steps, one with a mask, and
/// two with levels.
inline void writeContinuedSequence(const std::filesystem::path& path) {
  SequenceWriter writer(path, {true, PartialSequence::kReplace});
  const Change change;
  EsvrFile last = appended(writer, 1, frameOf(gridOf(firstFrame(80, true))), nullptr);
  const auto before = [&]() -> const QuantisedEllipsoids& { return last.grids[0].quantised[0]; };
  const auto next = [&](const Lattice& lattice) {
    return frameAfter(before(), mostOf(before(), 9), change, lattice);
  };
  last = appended(writer, 2, frameOf(gridOf(withNew(next(before().lattice), 12))), &last);
  last = appended(
      writer, 3, frameOf(gridOf(next(withMovedCells(codec::refined(before().lattice, 2))))), &last);
  last = appended(writer, 4, frameOf(withMask(gridOf(next(before().lattice)), 0)), &last);
  for (const int frame : {1, 2})
    last = appended(writer, 4 + frame, frameOf(withLevels(gridOf(next(before().lattice)), frame)),
                    &last);
  (void)writer.finish();
}

}  // namespace esvr::test
