#pragma once
/// The parts that a written file does without, and what the conversion decided about means of
/// making it smaller.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vdb2esvr/records.h"

namespace esvr::vdb2esvr {

struct LeftOut {
  std::string part, why;
  bool used = false;  ///< the file has the part; only decisions list such parts
  std::optional<std::uint64_t> bytesWith{}, bytesWithout{};  ///< measured by a decision
  std::optional<double> seconds{};                           ///< time that deciding took
};

/// \param grid  index of the grid in the record
[[nodiscard]] std::vector<LeftOut> leftOut(const RunRecord& record, std::size_t grid);

}  // namespace esvr::vdb2esvr
