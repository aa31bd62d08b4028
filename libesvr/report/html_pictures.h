#pragma once
/// Pictures within a page. All of them are enlarged and moved together.

#include <string>
#include <vector>

#include "report/emphasis.h"
#include "report/html.h"

namespace esvr::report {

/// A picture with its errors.
struct Shot {
  std::string name, figures{};  ///< caption: what it shows, and what was measured
  std::string png{};
  std::string errorPng{};  ///< in the colors of errorScale(); empty for the reference
  Emphasis emphasis = Emphasis::kNone;
};

struct PictureSheet {
  std::string caption{};
  Shot reference;
  std::vector<Shot> shots{};   ///< those of kOurs are also shown in halves with the reference
  std::vector<Shot> others{};  ///< are folded
};

[[nodiscard]] Html toHtml(const PictureSheet& sheet);

}  // namespace esvr::report
