#pragma once
/// Collects the sections of a file or of a frame, and puts ellipsoids into the order of the file.

#include <optional>
#include <vector>

#include "esvr/container.h"
#include "format/section_writer.h"

namespace esvr::format {

/// The order of a chunk's ellipsoids in the file. Neighbours in space are neighbours in the
/// streams, which then compress better and are evaluated with fewer cache misses.
///
/// Returns the ellipsoids in Morton order of their centers, which must be finite. Ellipsoids of one
/// cell keep their order, so that sorting again changes nothing.
[[nodiscard]] Ellipsoids inMortonOrder(const Ellipsoids& ellipsoids);

/// The sections of a file, which must outlive them.
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] SectionWriter sectionsOf(const EsvrFile& file);

/// The sections of a frame that refers to the previous one.
struct FrameSections {
  SectionWriter sections;
  Inherited inherited;
};
/// \return nothing if no grid is smaller as a difference from the previous frame
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::optional<FrameSections> differencesOf(const EsvrFile& frame,
                                                         const EsvrFile& previous);

/// Largest number of bytes that the section of voxels which are not finite adds to a file; 0 if the grid needs none.
[[nodiscard]] std::uint64_t bytesOfNonFinite(const StoredGrid& grid);

/// The difference of a grid from that of the previous frame, if it takes fewer bytes in a frame than
/// the grid.
/// \param ownBytes  bytes of the grid without a previous frame
[[nodiscard]] std::optional<std::vector<std::byte>> differenceOf(const StoredGrid& grid,
                                                                 const StoredGrid& previous,
                                                                 std::uint64_t ownBytes);

}  // namespace esvr::format
