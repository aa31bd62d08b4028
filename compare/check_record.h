#pragma once
/// What a check found.

#include <cstdint>
#include <string>
#include <vector>

#include "compare/differences.h"
#include "compare/figures.h"
#include "esvr/metrics.h"

namespace esvr::compare {

struct CheckedGrid {
  std::string name, candidateName;  ///< unique names in either file
  VolumeMetrics metrics{};
  FigureValues figures{};
  std::vector<Difference> differences{};
};

struct CheckRecord {
  std::uint64_t candidateBytes = 0;
  std::vector<CheckedGrid> grids;
  std::vector<Difference> fileDifferences;
  std::vector<std::string> skipped;   ///< grids that hold nothing to compare, and why
  std::vector<std::string> extra;     ///< grids of the candidate that the reference lacks
  std::vector<std::string> failures;  ///< a line each
  std::vector<std::string> notes;     ///< what is worth telling and no failure
};

}  // namespace esvr::compare
