#pragma once
/// The results of a check as text and as JSON.

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>

#include "compare/check_options.h"
#include "compare/check_record.h"

namespace esvr::compare {

void printCheck(const CheckRecord& record, std::ostream& out);

[[nodiscard]] nlohmann::ordered_json checkReport(const CheckOptions& options,
                                                 const CheckRecord& record);

}  // namespace esvr::compare
