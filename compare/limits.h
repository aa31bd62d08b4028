#pragma once
/// Checks figures against limits.

#include "compare/check_options.h"
#include "compare/check_record.h"

namespace esvr::compare {

/// Appends a line to the record's failures for every limit that a grid misses.
void judgeLimits(const CheckOptions& options, CheckRecord& record);

/// Appends a line if the file is larger than allowed.
void judgeBytes(const CheckOptions& options, CheckRecord& record);

/// Appends a line for every difference of the kinds that fail.
void judgeDifferences(const CheckOptions& options, CheckRecord& record);

}  // namespace esvr::compare
