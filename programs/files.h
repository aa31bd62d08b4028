#pragma once
/// The files of a run: inputs, among them those that come through a pipe, and outputs.

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/read_input.h"

namespace esvr::cli {

// Input files.

using esvr::readText;
using esvr::WatchedInputs;

/// The name of standard input as an input file.
inline constexpr const char* kStandardInput = "-";

/// Lets messages and reports show a file that a program made of an input under the name of this input.
void showInputAs(const std::filesystem::path& file, const std::string& name);

/// A text in which such files have the names of the inputs. \param isJson  they are in strings of JSON
[[nodiscard]] std::string withNamesOfInputs(std::string text, bool isJson = false);

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

/// True if there is a file or a folder of this name. Whoever opens it reports why it cannot be read.
[[nodiscard]] bool isThere(const std::filesystem::path& path);

struct InputFiles {
  /// All files that arguments and options name as inputs; a copy in place of a pipe.
  std::vector<std::filesystem::path> paths;
  std::vector<std::shared_ptr<const PipedInput>> piped;  ///< keeps the copies
};

// Output files.

/// \throws UsageError  the extension is none of these
void requireExtension(const std::filesystem::path& path,
                      std::initializer_list<std::string_view> extensions);

/// Checks before the work begins that a file can be written. Reports and pictures may go to a
/// device or a pipe of any name.
/// \throws UsageError  the extension is another one
/// \throws RuntimeFailure  the file exists (without `overwrite`) or is not writable
void checkOutput(const std::filesystem::path& path,
                 std::initializer_list<std::string_view> extensions, bool overwrite);

/// Checks that no output of a run is one of its inputs or another one of its outputs, be it by the
/// same name, through a link or as the same inode. Empty names and "-" (standard input and output)
/// are no files, and devices such as /dev/null may be named several times.
/// \throws UsageError  the text names both
void requireSeparate(const std::vector<std::filesystem::path>& inputs,
                     const std::vector<std::filesystem::path>& outputs);

/// Writes the whole file or nothing. A device or a pipe, such as /dev/null, is written directly.
/// \throws RuntimeFailure  the file exists (without `overwrite`) or is not writable; the disk is
///                         full
void writeBytes(const std::filesystem::path& path, std::span<const std::byte> bytes,
                bool overwrite);

/// The name of standard output as a file of a report.
inline constexpr const char* kStandardOutput = "-";

struct JsonFile {
  std::string path;  ///< kStandardOutput: stdout
  bool overwrite = false;
};

/// JSON that may be printed to a terminal: if a text in it could control the terminal (shownText in
/// esvr/grid.h), all characters beyond ASCII are escaped. Bytes that are not UTF-8 are replaced.
/// \param indent  columns of a level; -1: everything is in one line
[[nodiscard]] std::string jsonText(const nlohmann::ordered_json& json, int indent);

/// Writes the whole file or nothing, as jsonText. Bytes of names that are not UTF-8 are replaced.
/// \throws RuntimeFailure  the file is not writable
void writeJson(const JsonFile& file, const nlohmann::ordered_json& json);

}  // namespace esvr::cli
