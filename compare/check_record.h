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
  double range = 0.0;  ///< to which limits in % refer: valueRangeOf() or valueRangeOfVectors()
  /// The row has the lengths of vectors. Limits on errors hold for the components, as the bounds of
  /// a conversion do; the error of a length is at most sqrt(3) times theirs.
  bool isLengths = false;
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
  /// Grids whose voxels cannot be compared, such as those with NaN, with the reason.
  std::vector<std::string> unreadable;
  std::vector<std::string> notes;  ///< remarks that are not failures
};

}  // namespace esvr::compare
