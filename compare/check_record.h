#pragma once
/// The results of a check.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compare/differences.h"
#include "compare/figures.h"
#include "esvr/metrics.h"

namespace esvr::compare {

struct CheckedGrid {
  std::string name, candidateName;  ///< unique names in the two files
  VolumeMetrics metrics{};
  FigureValues figures{};
  std::vector<Difference> differences{};
  std::optional<std::int64_t> frame{};  ///< number of its frame, if the files are sequences
};

struct CheckRecord {
  std::uint64_t candidateBytes = 0;
  std::vector<CheckedGrid> grids;
  std::vector<Difference> fileDifferences;
  /// Grids without figures that are the same in both files, one line each.
  std::vector<std::string> same;
  std::vector<std::string> skipped;   ///< grids that cannot be compared, with the reason
  std::vector<std::string> extra;     ///< grids of the candidate that the reference does not have
  std::vector<std::string> failures;  ///< one line for each failure
  std::vector<std::string> notes;     ///< remarks that are not failures
};

}  // namespace esvr::compare
