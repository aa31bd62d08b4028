#include "cli/error_bound.h"

#include <cmath>
#include <cstdlib>

#include "esvr/error.h"

namespace esvr::cli {

ErrorBound parseErrorBound(const std::string& option, const std::string& text) {
  constexpr double kPercent = 100.0;
  char* end = nullptr;
  ErrorBound bound{.amount = std::strtod(text.c_str(), &end)};
  bound.relative = std::string(end) == "%";
  if (bound.relative) bound.amount /= kPercent;
  const bool number = end != text.c_str() && (*end == '\0' || bound.relative);
  if (!number || !(bound.amount > 0.0 && std::isfinite(bound.amount)))
    throw UsageError("--" + option + " must be a number above 0 such as 0.01 or 1%, not '" + text +
                     "'");
  return bound;
}

}  // namespace esvr::cli
