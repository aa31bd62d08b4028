#pragma once
/// Names of files with a place for the number of a frame.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/frame_range.h"

namespace esvr::cli {

/// A path in which a pattern stands for the number of a frame:
///
///     #                    four digits: smoke.#.vdb is smoke.0007.vdb
///     ##, ###, ####, ...   as many digits
///     @, @@, @@@, ...      as many digits
///     %04d, %d             as many digits as in printf; %d is one digit
///     $F4, $F              as many digits as in Houdini; $F is one digit
///
/// Smaller numbers begin with zeros, larger ones have more digits. A minus takes the place of a
/// digit, as in printf: "-001". The pattern may be in the name of a folder. If a path has several
/// patterns, the last one stands for the frame, and the others for themselves.
///
/// A path that a pattern gives for a frame belongs to this frame only: smoke.@.vdb is smoke.7.vdb,
/// and smoke.0007.vdb does not match it.
class FramePattern {
 public:
  /// The pattern in a path; nothing if there is none.
  /// \throws UsageError  it asks for more than 32 digits
  [[nodiscard]] static std::optional<FramePattern> in(const std::string& path);

  /// A path without a pattern, which all frames have in common.
  [[nodiscard]] static FramePattern whole(const std::string& path);
  [[nodiscard]] bool isWhole() const { return pattern_.empty(); }

  /// The path of a frame.
  [[nodiscard]] std::filesystem::path at(FrameNumber frame) const;

  /// The frames whose paths exist, increasing.
  [[nodiscard]] std::vector<FrameNumber> onDisk() const;

  /// A file whose name would match with another number of digits; nothing if there is none.
  [[nodiscard]] std::optional<std::filesystem::path> withOtherDigits() const;

  /// The path with the pattern.
  [[nodiscard]] const std::string& text() const { return text_; }
  /// The pattern alone, for example "####"; empty for a whole path.
  [[nodiscard]] const std::string& pattern() const { return pattern_; }
  /// The folder of the file or folder whose name has the pattern, or of a whole path.
  [[nodiscard]] std::filesystem::path folder() const;
  /// True if the name of a folder has the pattern.
  [[nodiscard]] bool isInFolder() const { return after_.find('/') != std::string::npos; }

 private:
  FramePattern() = default;
  [[nodiscard]] std::string digitsOf(FrameNumber frame) const;
  /// The entries of the folder whose names have a number in the pattern's place.
  struct Entry;
  [[nodiscard]] std::vector<Entry> entries() const;

  std::string text_, pattern_;
  std::string before_, after_;  ///< parts of the path before and after the pattern
  std::size_t digits_ = 1;
};

}  // namespace esvr::cli
