#pragma once
/// Compares the grids of two files.

#include "compare/check_options.h"
#include "compare/check_record.h"
#include "compare/grid_file.h"
#include "compare/temporal.h"
#include "esvr/progress.h"

namespace esvr::compare {

struct FilePair {
  const GridFile& reference;
  const GridFile& candidate;
  const CancelToken& cancel;
};

/// Compares the grids that the options name, and judges limits and differences.
/// \param temporal  compares with the frame before, if the files are frames of sequences; else null
/// \throws BadInput  the files cannot be compared
/// \throws Cancelled
[[nodiscard]] CheckRecord compareFiles(const CheckOptions& options, const FilePair& files,
                                       TemporalComparison* temporal);

}  // namespace esvr::compare
