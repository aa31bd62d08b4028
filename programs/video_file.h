#pragma once
/// Videos, which the program ffmpeg encodes, and programs that read data from their standard input.

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "esvr/device.h"
#include "esvr/image.h"

namespace esvr::report {

/// The first executable file of this name in the folders of PATH; nothing if there is none.
[[nodiscard]] std::optional<std::filesystem::path> findProgram(const std::string& name);

/// A file descriptor that is closed with its owner.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int get() const { return number_; }
  void take(int number);
  void close();

 private:
  int number_ = -1;
};

/// Two connected descriptors. Writing to a socket can report a reader that is gone without a signal,
/// which writing to a pipe cannot.
struct SocketPair {
  SocketPair();
  Descriptor ours, theirs;
};

/// A running program, which is killed if it has not ended when this object is destroyed. It belongs
/// to a process group of its own, so that Ctrl-C reaches only the process that started it, which
/// then decides what becomes of the output.
class ChildProgram {
 public:
  /// Starts a program without a shell. Its standard output is discarded.
  /// \param cancel  ends the waits of write() and finish(); must outlive this object
  /// \throws RuntimeFailure  the system cannot start it
  ChildProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
               const CancelToken& cancel);
  ~ChildProgram();
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  /// Writes to the program's standard input. \return false if the program no longer reads
  /// \throws Cancelled
  [[nodiscard]] bool write(std::span<const std::byte> bytes);

  /// Closes the standard input and waits for the program's end.
  /// \return nothing if the exit code was 0; otherwise the last line that the program wrote to its
  ///         standard error, or how it ended if there is none
  /// \throws Cancelled
  [[nodiscard]] std::optional<std::string> finish();

 private:
  void start(const std::filesystem::path& program, std::vector<std::string> words);
  void waitUntilWritable() const;
  [[nodiscard]] std::string lastMessage() const;

  const CancelToken& cancel_;
  /// The program's standard error. It is kept in memory, because a program that nobody reads from
  /// would wait as soon as a pipe is full.
  Descriptor messages_;
  SocketPair input_;
  pid_t id_ = 0;  ///< 0: the program has ended
};

/// True if the name ends in .mp4 or .webm.
[[nodiscard]] bool isVideo(const std::filesystem::path& path);

/// \throws UsageError  ffmpeg is not in PATH
[[nodiscard]] std::filesystem::path findFfmpeg();

/// \throws UsageError  a side is odd, which a video with colors of half resolution cannot have
void checkVideoSize(int width, int height);

struct VideoForm {
  int width = 0, height = 0;           ///< pixels; even numbers
  double fps = 30.0;                   ///< pictures per second
  std::array<double, 3> background{};  ///< sRGB color behind the pictures
  std::string comment;                 ///< text for the metadata
  bool overwrite = false;
};

/// A video that is being written: H.264 in an .mp4 file, VP9 in a .webm file. The pictures pass to
/// ffmpeg through its standard input. The file appears under its name when it is complete; nothing
/// is left of it otherwise.
class VideoFile {
 public:
  /// Starts ffmpeg. \param cancel  ends all waits for ffmpeg; must outlive this object
  /// \throws UsageError      ffmpeg is not in PATH
  /// \throws RuntimeFailure  the file exists (without `overwrite`) or is not writable
  VideoFile(std::filesystem::path path, const VideoForm& form, const CancelToken& cancel);

  /// \throws RuntimeFailure  ffmpeg has ended; the text has its last message
  /// \throws Cancelled
  void add(const Image& image);
  /// Waits for ffmpeg and gives the file its name. \throws RuntimeFailure, Cancelled  as for add
  void finish();

 private:
  [[noreturn]] void fail(const std::string& why) const;
  void checkEnd();

  std::filesystem::path path_;
  std::array<double, 3> background_;
  AtomicFile file_;
  ChildProgram ffmpeg_;  ///< behind the file, so that ffmpeg ends before the file is removed
};

}  // namespace esvr::report
