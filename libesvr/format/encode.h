#pragma once
/// Collects the sections of a file or of a frame.

#include <optional>
#include <vector>

#include "esvr/container.h"
#include "format/section_writer.h"

namespace esvr::format {

/// The sections of a file, which must outlive them.
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] SectionWriter sectionsOf(const EsvrFile& file, FileLayout layout);

/// The sections of a frame that refers to the previous one.
struct FrameSections {
  SectionWriter sections;
  Inherited inherited;
};
/// \return nothing if no grid is smaller as a difference from the previous frame
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::optional<FrameSections> differencesOf(const EsvrFile& frame,
                                                         const EsvrFile& previous);

/// The difference of a grid from that of the previous frame, if it takes fewer bytes in a frame than
/// the grid.
/// \param ownBytes  bytes of the grid without a previous frame
[[nodiscard]] std::optional<std::vector<std::byte>> differenceOf(const StoredGrid& grid,
                                                                 const StoredGrid& previous,
                                                                 std::uint64_t ownBytes);

}  // namespace esvr::format
