#include "cli/error_bound.h"

#include "cli/number.h"
#include "esvr/error.h"

namespace esvr::cli {

ErrorBound parseErrorBound(const std::string& option, const std::string& text) {
  constexpr double kPercent = 100.0;
  const auto number = parseLeadingNumber(text);
  const bool relative = number && number->rest == "%";
  if (!number || !(number->value > 0.0) || !(relative || number->rest.empty()))
    throw UsageError("--" + option + " must be a number above 0 such as 0.01 or 1%, not '" + text +
                     "'");
  return {relative ? number->value / kPercent : number->value, relative};
}

}  // namespace esvr::cli
