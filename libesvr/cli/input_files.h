#pragma once
/// The input files of a run, among them those that come through a pipe.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/read_input.h"

namespace esvr::cli {

using esvr::readText;
using esvr::WatchedInputs;

/// The name of standard input as an input file.
inline constexpr const char* kStandardInput = "-";

/// A volume that comes through a pipe. Readers need to move back and forth in a file, so that the
/// bytes are copied to a file first, which has no name and ends with the process.
class PipedInput {
 public:
  /// True for "-" and for the name of a pipe, such as that of `<(...)` in a shell.
  [[nodiscard]] static bool isPipe(const std::string& input);

  /// Copies the pipe into a file in `folder`.
  /// \throws BadInput  the bytes are no .vdb, .nvdb or .esvr file; they cannot be read
  /// \throws RuntimeFailure  the file cannot be written, or would take more than half of the space
  ///                         that the disk has
  PipedInput(const std::string& input, const std::filesystem::path& folder);
  ~PipedInput();
  PipedInput(const PipedInput&) = delete;
  PipedInput& operator=(const PipedInput&) = delete;

  /// A name under which the copy can be opened as long as this object exists. Its extension is that
  /// of the format.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int fd_ = -1;
};

struct InputFiles {
  /// All files that arguments and options name as inputs; a copy in place of a pipe.
  std::vector<std::filesystem::path> paths;
  std::vector<std::shared_ptr<const PipedInput>> piped;  ///< keeps the copies
};

}  // namespace esvr::cli
