#pragma once
/// Collects the sections of a file or of a frame.

#include "esvr/container.h"
#include "format/section_writer.h"

namespace esvr::format {

/// The sections of a file, which must outlive them.
/// \param previous  the previous frame, to which grids may refer; null: there is none
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] SectionWriter sectionsOf(const EsvrFile& file, const EsvrFile* previous = nullptr);

}  // namespace esvr::format
