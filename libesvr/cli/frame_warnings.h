#pragma once
/// Collects the warnings of a sequence, in which many frames have the same ones, so that each is
/// told once with its frames.

#include <map>
#include <mutex>
#include <set>
#include <string>

#include "cli/log.h"
#include "cli/sequence.h"

namespace esvr::cli {

class FrameWarnings {
 public:
  /// Notes a warning of a frame. Any thread may call it, also twice for the same warning.
  void add(FrameNumber frame, const std::string& text);

  /// The log of a frame, whose warnings are noted here.
  [[nodiscard]] Log logOf(const Frame& frame, const std::string& program, Verbosity verbosity);

  /// Prints each warning with its frames, in the order of the texts.
  void tell(const Log& log) const;

 private:
  std::mutex mutex_;
  std::map<std::string, std::set<FrameNumber>> frames_;  ///< by the text of the warning
};

}  // namespace esvr::cli
