#pragma once
/// esvr-compare check for sequences.

#include "compare/check_options.h"
#include "compare/check_record.h"
#include "esvr/progress.h"

namespace esvr::compare {

/// True if the reference or the candidate is a sequence.
/// \throws BadInput  a file is damaged
[[nodiscard]] bool areSequences(const CheckOptions& options);

/// Compares the frames of two sequences, each with the frame of the same number and with the change
/// from the frame before it. A frame that only one of them has is a failure.
/// \return one record, in which the names of grids begin with the frame: "frame 7: density"
/// \throws UsageError  only one of the two is a sequence
/// \throws BadInput  the files cannot be compared
/// \throws Cancelled
[[nodiscard]] CheckRecord checkSequence(const CheckOptions& options, const CancelToken& cancel);

}  // namespace esvr::compare
