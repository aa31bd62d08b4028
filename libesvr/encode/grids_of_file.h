#pragma once
/// What the parts of the conversion of a file work on: single grids of it, and the file of all.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "esvr/convert_file.h"

namespace esvr::encode {

/// What one conversion of a grid is to give.
struct Wish {
  std::optional<std::uint64_t> bytes{};  ///< bytes that it may add to the file
  /// A grid that is like this one and that its voxels are to refer to; null: the same grid of the previous
  /// frame, if there is one.
  const StoredGrid* expected = nullptr;
};

/// A hash of the active voxels of a volume, whatever their values. (references.cpp)
[[nodiscard]] InputKey activeKeyOf(const SparseVolume& volume);

/// Reads and converts single grids of a file.
class GridConverter {
 public:
  GridConverter(const std::vector<GridSource>& grids, const FileOptions& options)
      : grids_(grids), options_(options), fit_(options.convert.fit), scales_(grids.size()) {}

  [[nodiscard]] bool isCancelled() const;

  /// Runs a step of a conversion that is alone.
  void step(std::size_t g, const std::function<void()>& run);

  /// Reads vectors for the peak and the range of their components, and for their active voxels.
  void findScales();

  [[nodiscard]] VolumeGrid read(std::size_t g) const { return grids_[g].read(); }
  [[nodiscard]] SourceKey keyOf(std::size_t g, const VolumeGrid& source) const;
  [[nodiscard]] const Goal& goalOf(std::size_t g) const;
  /// The same grid of the previous frame, which is the one with its number among those that are stored by its
  /// name; null if there is none.
  [[nodiscard]] const StoredGrid* previousOf(std::size_t g) const;

  /// \throws Cancelled  the conversion has no result
  [[nodiscard]] GridConversion make(std::size_t g, const Wish& wish);
  /// The same on one of several threads, with options of its own.
  [[nodiscard]] GridConversion makeBeside(std::size_t g) const;
  /// The grid that is made from `source` for another grid that it is expected to be like.
  [[nodiscard]] Conversion convertLike(std::size_t g, const VolumeGrid& source,
                                       const StoredGrid& expected, const FitOptions& fit) const;
  /// Runs a step on one of several threads, with options of its own.
  void stepBeside(std::size_t g, const std::function<void(const FitOptions&)>& run) const;
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

  void step(const GridStep& step) const;
  void findScale(std::size_t g);
  [[nodiscard]] Goal resolvedGoal(std::size_t g, const VolumeGrid& source) const;
  [[nodiscard]] GridConversion readAndConvert(std::size_t g, const Wish& wish,
                                              const FitOptions& fit) const;
  void convert(std::size_t g, const VolumeGrid& source, const Wish& wish, ConvertOptions options,
               GridConversion& made) const;
  [[nodiscard]] bool needsExactSet(std::size_t g, const VolumeGrid& source) const;
  [[nodiscard]] bool isAsBefore(const StoredGrid* previous, const VolumeGrid& source,
                                const SourceKey& key) const;

  const std::vector<GridSource>& grids_;
  const FileOptions& options_;
  FitOptions fit_;  ///< options of the fits; their device may change
  std::vector<VectorScale> scales_;
  std::vector<ActiveSet> sets_;  ///< the active voxels of the vectors of the file
};

/// Calls body(i) for the numbers below `count` on at most so many threads, which begin in their order. None begins after
/// the token is set or one has thrown; the first exception is thrown again. (convert_file.cpp)
void forEachAtOnce(std::size_t count, std::size_t threads,
                   const std::function<void(std::size_t)>& body);

/// Chooses for each grid of voxels another grid of the file that its voxels refer to, where that takes fewer
/// bytes, and gives the file the compact layout. If the goal is a PSNR or a preset, the voxels are chosen again
/// for this coding. (share_grids.cpp)
void shareGrids(const FileOptions& options, GridConverter& converter, ConvertedFile& made);

/// A grid without its content, of which a file has little more than the record. (share_grids.cpp)
[[nodiscard]] StoredGrid recordAlone(const StoredGrid& grid);

}  // namespace esvr::encode
