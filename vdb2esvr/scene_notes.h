#pragma once
/// Lists the parts that a written file does not need to have.

#include <cstdint>
#include <string>
#include <vector>

#include "vdb2esvr/run_record.h"

namespace esvr::vdb2esvr {

struct LeftOut {
  std::string part, why;
  std::uint64_t bytesSaved = 0;  ///< bytes before compression; 0 if unknown
};

[[nodiscard]] std::vector<LeftOut> leftOut(const RunRecord& record, std::size_t grid);

}  // namespace esvr::vdb2esvr
