#pragma once
/// Checks figures against limits.

#include "compare/check_options.h"
#include "compare/check_record.h"

namespace esvr::compare {

/// Appends a line to the record's failures for every limit that a grid misses.
/// \param ranges  range of the reference's values by grid, for limits that are shares of it
void judgeLimits(const CheckOptions& options, std::span<const double> ranges, CheckRecord& record);

/// Appends a line if the file is larger than allowed.
void judgeBytes(const CheckOptions& options, CheckRecord& record);

/// Appends a line for every difference of the kinds that fail.
void judgeDifferences(const CheckOptions& options, CheckRecord& record);

}  // namespace esvr::compare
