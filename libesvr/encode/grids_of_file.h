#pragma once
/// What the parts of the conversion of a file work on: single grids of it, and the file of all.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "esvr/convert_file.h"

namespace esvr::encode {

/// Reads and converts single grids of a file.
class GridConverter {
 public:
  GridConverter(const std::vector<GridSource>& grids, const FileOptions& options)
      : grids_(grids), options_(options), fit_(options.convert.fit), scales_(grids.size()) {}

  [[nodiscard]] bool isCancelled() const;

  /// Runs a step of a conversion. \param isAlone  false: it is one of several at the same time, with options of its own
  void step(std::size_t g, bool isAlone, const std::function<void(const FitOptions&)>& run);

  /// Reads vectors for the peak and the range of their components, and for their active voxels.
  void findScales();

  [[nodiscard]] VolumeGrid read(std::size_t g) const { return grids_[g].read(); }
  [[nodiscard]] SourceKey keyOf(std::size_t g, const VolumeGrid& source) const;
  [[nodiscard]] const Goal& goalOf(std::size_t g) const;
  /// Replaces the goals of all grids.
  void setGoal(const Goal& goal) { goal_ = goal; }
  /// The same for a trial, of which FileOptions::onConverted is not told. \param asVoxels  true for grids of which only
  /// voxels are considered
  void tryGoal(const Goal& goal, std::vector<bool> asVoxels) {
    goal_ = goal, isTrial_ = true, asVoxels_ = std::move(asVoxels);
  }
  /// Tells FileOptions::onConverted of a conversion, unless it is a trial.
  void tell(const VolumeGrid& source, const GridConversion& made) const;
  /// Reads the grids of a trial that is the result, and tells of all of them.
  void tellAll(const std::vector<GridConversion>& grids);
  /// The same grid of the previous frame, which is the one with its number among those that are stored by its
  /// name; null if there is none.
  [[nodiscard]] const StoredGrid* previousOf(std::size_t g) const;

  /// Reads a grid and converts it in a step. \throws Cancelled  the conversion has no result
  [[nodiscard]] GridConversion make(std::size_t g, bool isAlone);
  /// Converts a grid within a step. \param expected  a grid that is like this one and that its voxels are to
  /// refer to; null: the same grid of the previous frame, if there is one
  [[nodiscard]] GridConversion convert(std::size_t g, const VolumeGrid& source,
                                       const StoredGrid* expected, const FitOptions& fit) const;
  /// Number of small grids that are worked on at the same time.
  [[nodiscard]] std::size_t mostAtOnce() const;

 private:
  /// What all grids of a component's vectors have in common.
  struct VectorScale {
    std::optional<double> peak, range;
  };

  /// The active voxels of vectors, and where they are.
  struct ActiveSet {
    InputKey voxels;
    Transform transform;
    friend bool operator==(const ActiveSet&, const ActiveSet&) = default;
  };

  void findScale(std::size_t g);
  [[nodiscard]] Goal resolvedGoal(std::size_t g, const VolumeGrid& source) const;
  [[nodiscard]] bool needsExactSet(std::size_t g, const VolumeGrid& source) const;
  [[nodiscard]] const GridBefore* recordOf(const StoredGrid* previous) const;
  [[nodiscard]] bool isAsBefore(const StoredGrid* previous, const VolumeGrid& source,
                                const SourceKey& key) const;

  const std::vector<GridSource>& grids_;
  const FileOptions& options_;
  FitOptions fit_;            ///< options of the fits; their device may change
  std::optional<Goal> goal_;  ///< instead of those of all grids
  bool isTrial_ = false;
  std::vector<bool> asVoxels_;
  std::vector<VectorScale> scales_;
  std::vector<ActiveSet> sets_;  ///< the active voxels of the vectors of the file
};

/// True for a grid whose conversion keeps few threads busy: its voxels are coded in one or two blocks, each on one thread.
[[nodiscard]] bool isSmall(const GridSource& grid);

/// Calls body(i) for the numbers below `count` on at most so many threads, which begin in their order. None begins after
/// the token is set or one has thrown; the first exception is thrown again.
void forEachAtOnce(std::size_t count, std::size_t threads,
                   const std::function<void(std::size_t)>& body);

// What follows is in share_grids.cpp.

/// Chooses for each grid of voxels another grid of the file that its voxels refer to, where that takes fewer
/// bytes, and gives the file the compact layout. If the goal is a PSNR or a preset, the voxels are chosen again
/// for this coding.
void shareGrids(const FileOptions& options, GridConverter& converter, ConvertedFile& made);

/// Chooses a reference for a grid of voxels. Candidates are compared on a sample of its bricks.
/// \param grids  the grids of a file. Those of `candidates` must be before `grid`, and those among
///               them that hold no voxels are ignored.
/// \return the reference with which the voxels take the fewest bytes of those that were tried, the
///         empty one among them. They may take even fewer without a reference (bytesAdded).
[[nodiscard]] VoxelReference chooseReference(std::span<const StoredGrid> grids, std::size_t grid,
                                             std::span<const std::size_t> candidates);

/// The grid that a reference names, with the values that are expected for the grid that refers to
/// it. As ConvertOptions::previous it makes a conversion choose voxels that take few bytes with this
/// reference.
/// \param grid  refers to the other grid
[[nodiscard]] StoredGrid expectedFrom(std::span<const StoredGrid> grids, std::size_t grid,
                                      const VoxelReference& reference);

/// A grid without its content, of which a file has little more than the record.
[[nodiscard]] StoredGrid recordAlone(const StoredGrid& grid);

}  // namespace esvr::encode
