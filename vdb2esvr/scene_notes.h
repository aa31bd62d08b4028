#pragma once
/// What the written file does without, since the scene does not need it.

#include <cstdint>
#include <string>
#include <vector>

#include "vdb2esvr/run_record.h"

namespace esvr::vdb2esvr {

struct LeftOut {
  std::string part, why;
  std::uint64_t bytesSaved = 0;  ///< before compression; 0 where it cannot be said
};

[[nodiscard]] std::vector<LeftOut> leftOut(const RunRecord& record, std::size_t grid);

}  // namespace esvr::vdb2esvr
