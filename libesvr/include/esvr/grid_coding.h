#pragma once
/// Turns a fitted field into a stored grid and a stored grid back into voxels, and encodes the stored grids of
/// the frames of a sequence.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/field.h"
#include "esvr/grid.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"

namespace esvr {

/// Makes a stored grid from a fitted field and the properties of its source. It chooses the rule by
/// which a reader determines the active voxels:
///  - a threshold. Among the thresholds that increase the squared error by at most 0.004 dB, it is
///    the one whose active voxels have the largest intersection over union with the source's. A few
///    voxels of the source (boxVoxels, volume.h) are active in any case, so that the active box is the
///    source's, whatever becomes of the ellipsoids later;
///  - the source's active mask, if `activity` is kExact, or if no threshold restores a voxel
///    because all values equal the background;
///  - for a narrow band, the rule of kBricks (container.h) with the source's bricks and the same few
///    voxels, unless `activity` is kExact.
/// The curve is left empty.
[[nodiscard]] StoredGrid makeStoredGrid(const GridDescriptor& descriptor,
                                        const SparseVolume& source, Field field,
                                        Activity activity = Activity::kByValue);

/// True for a closed level set: its background (the half width of its band) is above 0 and not
/// exceeded by an active voxel, an active voxel is negative, and the signs around its empty space
/// agree (EmptySigns::agree). makeStoredGrid stores such a grid as a narrow band, and
/// FitOptions::narrowBand is intended for it. Any other level set is fitted and stored like other
/// grids.
[[nodiscard]] bool isNarrowBand(const GridDescriptor& descriptor, const SparseVolume& source);

/// Why a grid is no narrow band, as the part of a sentence after "because"; empty if it is one.
[[nodiscard]] std::string whyNoNarrowBand(const GridDescriptor& descriptor,
                                          const SparseVolume& source);

/// Makes a stored grid that holds voxels and no ellipsoids.
/// \param layer  the voxels of `source` (quantised.h)
[[nodiscard]] StoredGrid makeStoredVoxels(const GridDescriptor& descriptor,
                                          const SparseVolume& source, VoxelLayer layer);

/// The rule by which decodeGrid() makes voxels from the sum: the grid's threshold, range, band,
/// bricks, mask, active box and box voxels, without its residual. It refers to the lists of `grid`.
[[nodiscard]] RevoxeliseOptions voxelRule(const StoredGrid& grid);

/// True if the voxels of a grid follow from its ellipsoids by voxelRule() alone. This is not so if
/// it stores voxels, a residual or voxels that are not finite, or if its inactive voxels have a far background.
[[nodiscard]] bool followsFromEllipsoids(const StoredGrid& grid);

struct DecodeOptions {
  /// Replaces the grid's own threshold with its box voxels, or its mask within the mask's bricks; 0 or
  /// above.
  std::optional<float> threshold{};
  /// Voxels outside the box come back inactive, and bricks outside are not evaluated.
  std::optional<Box> box{};
  /// Limit on the memory of the evaluation and its result. Voxels in a file do not count.
  std::uint64_t maxBytes = kNoMemoryLimit;
  VoxelMemory memory{};  ///< holds the voxels
  /// False: voxels that are NaN or infinite come back as empty ones (dropNonFinite, volume.h), as drawing takes them.
  bool keepsNonFinite = true;
};

/// Estimates the work and memory that decodeGrid() takes at most. Nothing is evaluated.
[[nodiscard]] WorkEstimate estimateDecode(const StoredGrid& grid,
                                          const DecodeOptions& options = {});

/// The voxels that a stored grid represents. If the source was saved as half (ValueType::kHalf), the
/// active voxels are halfs (roundToHalfs, quantised.h), so that a .vdb file of them has the same
/// values and keeps the same bound. Voxels that the source had as NaN or infinite are that again, and active.
/// \throws UsageError  the threshold is negative or not finite, or the grid stores voxels or has a far
///                     background, so that it says itself which voxels are active
/// \throws MemoryExceeded  the estimate is above options.maxBytes; nothing was evaluated
[[nodiscard]] SparseVolume decodeGrid(const StoredGrid& grid, const DecodeOptions& options = {});

/// The vectors that the components of a grid represent. Their bricks and active masks are those of
/// decodeGrid().
/// \throws  as for decodeGrid; the components together may take options.maxBytes
[[nodiscard]] VectorGrid decodeVector(const std::string& name, StoredComponents components,
                                      const DecodeOptions& options = {});

// Encodes the frames of a sequence. The voxels of a frame may refer to those of the frame before
// it, which usually takes fewer bytes. docs/format.md, "Frames", specifies every byte.

/// True if two frames have the same grids in the same order, which agree in name, type, class and transform, so that
/// one can refer to the other. Voxels and metadata may differ.
[[nodiscard]] bool haveSameGrids(const EsvrFile& a, const EsvrFile& b);

/// Encodes a file as a frame. Each grid that holds voxels, and whose predecessor has the same number
/// in `previous` and holds voxels too, is stored as its difference from its predecessor if that
/// takes fewer bytes. All other grids are stored as encodeEsvr() stores them. The bytes are those of
/// encodeEsvr() if no grid refers to the previous frame. Otherwise they have a short form, without
/// the metadata, the vectors and the carried grids that are those of the previous frame.
/// \param previous  the frame before as decodeFrame() returned it; null: the frame stands alone
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::vector<std::byte> encodeFrame(const EsvrFile& frame, const EsvrFile* previous);

/// Decodes a frame.
/// \param nameForErrors  name of the file and number of the frame in error texts
/// \param previous  the frame that encodeFrame() was given; ignored if the frame stands alone
/// \throws BadInput  as for decodeEsvr; the frame refers to the previous one, and `previous` is null
///                   or has not the grids that it refers to
/// \throws MemoryExceeded  as for readEsvr
[[nodiscard]] EsvrFile decodeFrame(std::span<const std::byte> bytes,
                                   const std::string& nameForErrors, const ReadLimits& limits,
                                   const EsvrFile* previous);

/// True if decodeFrame() needs the previous frame.
/// \throws BadInput  the header or the section table of a frame that stands alone is damaged
[[nodiscard]] bool dependsOnPrevious(std::span<const std::byte> bytes);

/// Largest number of bytes that a grid adds to a frame, like bytesAdded() for a file.
/// \param previous  the same grid of the previous frame; null: the grid is stored on its own
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::uint64_t bytesInFrame(const StoredGrid& grid, const StoredGrid* previous);

}  // namespace esvr
