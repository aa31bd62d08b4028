#pragma once
/// Lists the parts that a written file does not need to have, and what the conversion decided about
/// four means of making it smaller (decision_notes.h).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vdb2esvr/run_record.h"

namespace esvr::vdb2esvr {

struct LeftOut {
  std::string part, why;
  bool used = false;  ///< the file has the part; only decisionNotes() lists such parts
  std::optional<std::uint64_t> bytesWith{}, bytesWithout{};  ///< measured by a decision
  std::optional<double> seconds{};                           ///< time that deciding took
};

[[nodiscard]] std::vector<LeftOut> leftOut(const RunRecord& record, std::size_t grid);

}  // namespace esvr::vdb2esvr
