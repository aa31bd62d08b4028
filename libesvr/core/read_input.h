#pragma once
/// Input files. A text is read as a whole, from a file or from a pipe. A file whose parts are read
/// one after the other must not change meanwhile, because its parts would then not fit together.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace esvr {

/// The bytes of a file or a pipe, from the first one on. Nothing waits for ever for a pipe that no
/// program writes to, such as a FIFO that was left over: another program has 5 seconds to open it.
class InputStream {
 public:
  /// \throws BadInput  the file is missing, not readable, or neither a file nor a pipe
  explicit InputStream(const std::filesystem::path& path);
  /// The standard input of the process, of any kind but a terminal.
  /// \throws BadInput  it is closed or a terminal
  [[nodiscard]] static InputStream standardInput();
  InputStream(InputStream&& other) noexcept;
  InputStream& operator=(InputStream&&) = delete;
  ~InputStream();

  /// Reads the next bytes, at least one. \return how many; 0 at the end
  /// \throws BadInput  no program writes to the pipe; the bytes cannot be read
  [[nodiscard]] std::size_t read(std::span<std::byte> to);

 private:
  InputStream(std::string name, int fd) : name_(std::move(name)), fd_(fd) {}

  std::string name_;
  int fd_;
  bool mayHaveNoWriter_ = false;  ///< a pipe that nobody was seen to write to
};

/// The content of a text file or of a pipe, at most 256 MB.
/// \throws BadInput  it cannot be read, or is longer. The text names the file
[[nodiscard]] std::string readText(const std::filesystem::path& path);

/// What tells a file from the one that replaces it, and its content from later content.
struct FileStamp {
  std::uint64_t device = 0, inode = 0, bytes = 0;
  std::int64_t seconds = 0, nanoseconds = 0;  ///< time of the last change of the content

  bool operator==(const FileStamp&) const = default;
};

/// Nothing if there is no file of that name.
[[nodiscard]] std::optional<FileStamp> stampOf(const std::filesystem::path& path);

/// Files that are read between two moments.
class WatchedInputs {
 public:
  WatchedInputs() = default;
  explicit WatchedInputs(const std::vector<std::filesystem::path>& paths);

  /// Adds a file before it is opened. Whoever opens it reports that it is missing.
  void add(const std::filesystem::path& path);

  /// \throws BadInput  a file was replaced, changed or removed after it was added
  void requireUnchanged() const;

 private:
  struct Watched {
    std::filesystem::path path;
    FileStamp stamp;
  };
  std::vector<Watched> files_;
};

}  // namespace esvr
