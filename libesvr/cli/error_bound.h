#pragma once
/// Bounds on errors in options.

#include <string>

namespace esvr::cli {

/// A bound in units of the values, or as a share of their range.
struct ErrorBound {
  double amount = 0.0;
  bool relative = false;  ///< `amount` is a share of the range

  [[nodiscard]] double absolute(double range) const { return relative ? amount * range : amount; }
};

/// Parses "0.01", or "1%" for a share of the range of values.
/// \throws UsageError  the text is not of this form, or not above 0; the message names the option
[[nodiscard]] ErrorBound parseErrorBound(const std::string& option, const std::string& text);

}  // namespace esvr::cli
