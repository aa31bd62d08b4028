#pragma once
/// How rows, curves and pictures stand out.

namespace esvr::report {

enum class Emphasis { kNone, kOurs, kRival };

/// The class in page.css; empty for kNone.
[[nodiscard]] inline const char* classOf(Emphasis emphasis) {
  return emphasis == Emphasis::kOurs ? "ours" : emphasis == Emphasis::kRival ? "rival" : "";
}

}  // namespace esvr::report
