#pragma once
/// How a program runs and ends, and what it says meanwhile: text for people, with tables and what is shown of texts of unknown
/// origin, errors and exit codes, Ctrl-C, and the times of its phases.

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/counted.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/volume.h"

namespace esvr::cli {

/// A text without what could control the terminal or pretend to be another line of the program, such as
/// the name of a grid or a file (shownText in esvr/grid.h).
[[nodiscard]] std::string printable(const std::string& text);

/// The same for a message of the program, which may have several lines. Names in it were made safe
/// before, because their line ends would stay.
[[nodiscard]] std::string printableMessage(const std::string& text);

enum class Verbosity { kQuiet, kNormal, kVerbose };

/// Messages for people. They go to stderr, because stdout is for data. Any thread may print them.
class Log {
 public:
  /// Takes the text of a warning.
  using Warnings = std::function<void(const std::string&)>;

  /// \param warnings  takes the warnings, which are not printed then; may be empty
  Log(std::string program, Verbosity verbosity, Warnings warnings = {})
      : program_(std::move(program)), verbosity_(verbosity), warnings_(std::move(warnings)) {}

  /// Prints a message unless --quiet was given.
  void info(const std::string& message) const;
  /// Prints a message if --verbose was given.
  void detail(const std::string& message) const;
  /// Prints an error after which the program continues, also with --quiet.
  void error(const std::string& message) const;
  /// Prints a warning that something was not done as asked, unless --quiet was given.
  /// \param figure  printed in parentheses unless it is empty. Frames of a sequence, which differ
  ///                in it, have one warning without it
  void warning(const std::string& message, const std::string& figure = {}) const;

 private:
  std::string program_;
  Verbosity verbosity_;
  Warnings warnings_;
};

// Tables in the output of programs.

/// Rows of equal length. The first column is text, aligned left; the others are numbers, aligned
/// right.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  /// \throws std::logic_error  the row has other columns than the header
  void add(std::vector<std::string> row);
  void print(std::ostream& out) const;
  /// Prints the table in at most so many columns of text: with headers of two lines if it is too wide,
  /// and in several parts, each with the first column, if it still is. A text of the first column that
  /// takes more than a third of the width has a line of its own, and is shortened if it takes all of it.
  void print(std::ostream& out, std::size_t width) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// A number in a format of printf, in at most 400 characters.
[[nodiscard]] std::string formatted(const char* format, double value);
/// The fewest digits that give the number again.
[[nodiscard]] std::string exactNumber(double value);
/// A PSNR with two decimals, for example "51.54"; "exact" if it is infinite.
[[nodiscard]] std::string decibels(double value);
/// A PSNR and another one that a message says to differ from it, with as many decimals as that takes.
[[nodiscard]] std::pair<std::string, std::string> decibelsApart(double value, double other);
/// A number with four significant digits.
[[nodiscard]] std::string shortNumber(double value);
/// A number and another one that a message says to differ from it, with as many digits as that takes.
[[nodiscard]] std::pair<std::string, std::string> shortNumbersApart(double value, double other);
using esvr::counted;
/// What an interrupted run leaves, for example "1 of 3 frames is complete". \param thing  one of them
[[nodiscard]] std::string completeOf(std::uint64_t done, std::uint64_t all,
                                     const std::string& thing);
/// A time with one decimal, for example "12.3", so that a column is aligned.
[[nodiscard]] std::string seconds(double value);

// Parts of the output of --list.

/// A box as text, for example "(0, 0, 0) to (7, 7, 7)"; "empty" for an empty box.
[[nodiscard]] std::string textOf(const Box& box);

/// Prints a line with the name and the type of each item. \param title  start of each line
void printMetadata(const std::string& title, const std::vector<MetaItem>& items, std::ostream& out);

/// A word of a command for a shell, with quotes if it needs them.
[[nodiscard]] std::string shellWord(const std::string& word);

// ---- The main function of a program

/// Runs a program's body. If it throws, prints "NAME: text" to stderr and returns the exit code:
/// Error::exitCode(), 5 if memory ran out, and 1 for any other error or if stdout is not writable.
/// \param body  returns the exit code of a run that does not throw
int runMain(const std::string& program, const std::function<int()>& body);

/// The exception that is being handled, as an Error with the kind whose value is the exit code. To
/// be called in a catch clause.
[[nodiscard]] Error currentFailure();

/// Measures the time of a run's phases.
class Stopwatch {
 public:
  /// Seconds since construction or the last call.
  double lap() {
    const auto now = Clock::now();
    const std::chrono::duration<double> passed = now - start_;
    start_ = now;
    return passed.count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

// Ctrl-C (SIGINT) and SIGTERM.

/// What signals after the first one do.
enum class FurtherSignals {
  kEndAtOnce,  ///< the second one ends the process
  kAreIgnored  ///< for a process that something else kills if it does not end, as mpirun does
};

/// While it exists, the first SIGINT or SIGTERM sets the token instead of ending the process. The token
/// is that of the calling thread (CancelScope), so that all long calls of this thread end soon: with
/// Cancelled, or with the best result so far. Only one object may exist at a time, because a signal
/// handler can find its token only through a static pointer.
///
/// A run that has not ended kSecondsToEnd after the signal is in a call that nothing can end, for
/// example of a library or of a file system that does not answer. Unless a result is being completed
/// (Completion), the process is then ended with exit code 1. Outputs have their names only when they are
/// complete, so that it leaves nothing that a second Ctrl-C would not leave.
class Interrupts {
 public:
  /// Users expect a program to end within two seconds.
  static constexpr double kSecondsToEnd = 1.7;

  explicit Interrupts(FurtherSignals further = FurtherSignals::kEndAtOnce);
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  [[nodiscard]] const CancelToken& token() const { return token_; }
  /// See CancelToken::discardResults().
  void discardResults() { token_.discardResults(); }

 private:
  void watch() const;

  CancelToken token_;
  CancelScope scope_{&token_};
  int event_;  ///< an eventfd, to which the handler writes, and the destructor
  std::atomic<bool> ended_{false};
  std::thread watcher_;
  struct sigaction previousInt_ {
  }, previousTerm_{};
};

}  // namespace esvr::cli
