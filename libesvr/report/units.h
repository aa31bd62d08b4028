#pragma once
/// Short texts of figures with their units, for sentences and for the axes of plots.

#include <string>

namespace esvr::report {

/// Three significant digits without an exponent: "0.00012", "46.1", "258000".
[[nodiscard]] std::string plainText(double value);
/// A size in units of 1000: "800 B", "46.1 KB", "2.6 MB".
[[nodiscard]] std::string bytesText(double bytes);

}  // namespace esvr::report
