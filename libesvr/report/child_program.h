#pragma once
/// Runs a program that reads data from its standard input.

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/progress.h"

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

}  // namespace esvr::report
