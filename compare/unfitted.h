#pragma once
/// Compares grids that have no figures: those whose values are not floats or doubles, and those
/// without an active voxel.

#include "compare/check_options.h"
#include "compare/check_record.h"
#include "compare/grid_file.h"

namespace esvr::compare {

/// Indices of a grid in the two files.
struct GridPair {
  const GridFile& reference;
  std::size_t ofReference = 0;
  const GridFile& candidate;
  std::size_t ofCandidate = 0;

  [[nodiscard]] const ListedGrid& a() const { return reference.grids()[ofReference]; }
  [[nodiscard]] const ListedGrid& b() const { return candidate.grids()[ofCandidate]; }
};

/// True if the two grids are of types that cannot be compared with each other, or if one is of
/// doubles and the other one is not.
[[nodiscard]] bool isRetyped(const GridPair& pair);

/// The line that says how the type of a grid has changed.
[[nodiscard]] std::string retypedText(const GridPair& pair);

/// True if two grids have the same bytes in files without loss. They are read only if both files
/// have them.
[[nodiscard]] bool haveSameBytes(const GridPair& pair);

/// Compares two grids whose bytes are the same in files without loss. Appends a line to the
/// record's `same`, `failures` or, where one of the files is not a .vdb or .esvr file, `skipped`.
void compareUnfitted(const CheckOptions& options, const GridPair& pair, CheckRecord& record);

}  // namespace esvr::compare
