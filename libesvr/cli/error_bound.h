#pragma once
/// Bounds on errors as people write them.

#include <string>

namespace esvr::cli {

/// In units of the values, or as a share of their range.
struct ErrorBound {
  double amount = 0.0;
  bool relative = false;  ///< `amount` is a share of the range

  [[nodiscard]] double absolute(double range) const { return relative ? amount * range : amount; }
};

/// "0.01", or "1%" of the range of values. \throws UsageError  anything else, or not above 0; names
/// the option
[[nodiscard]] ErrorBound parseErrorBound(const std::string& option, const std::string& text);

}  // namespace esvr::cli
