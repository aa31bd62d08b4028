// How a program says messages, tables and texts of unknown origin, and how it runs and ends: errors and exit codes, Ctrl-C and SIGTERM.

#include "programs/run_main.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <ostream>
#include <stdexcept>
#include <string_view>

#include "core/atomic_file.h"
#include "programs/files.h"

namespace esvr::cli {

std::string printable(const std::string& text) {
  return shownText(withNamesOfInputs(text), LineEnds::kReplace);
}

std::string printableMessage(const std::string& text) {
  return shownText(withNamesOfInputs(text), LineEnds::kKeep);
}

namespace {

/// Writes the line at once, so that the lines of several threads do not mix.
void printLine(const std::string& line) { std::cerr << line + '\n'; }

}  // namespace

void Log::info(const std::string& message) const {
  if (verbosity_ != Verbosity::kQuiet) printLine(printableMessage(message));
}

void Log::detail(const std::string& message) const {
  if (verbosity_ == Verbosity::kVerbose) printLine(printableMessage(message));
}

void Log::error(const std::string& message) const {
  printLine(program_ + ": " + printableMessage(message));
}

void Log::warning(const std::string& message, const std::string& figure) const {
  if (warnings_) return warnings_(message);
  const std::string text = figure.empty() ? message : message + " (" + figure + ')';
  if (verbosity_ != Verbosity::kQuiet) printLine(program_ + ": warning: " + printableMessage(text));
}

namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string padded(const std::string& text, std::size_t width, bool flushLeft) {
  const std::string space(width - std::min(width, text.size()), ' ');
  return flushLeft ? text + space : space + text;
}

}  // namespace

void Table::add(std::vector<std::string> row) {
  if (row.size() != rows_.front().size())
    throw std::logic_error("a row of a table has " + std::to_string(row.size()) +
                           " cells, and its header " + std::to_string(rows_.front().size()));
  for (auto& cell : row) cell = printable(cell);
  rows_.push_back(std::move(row));
}

namespace {

constexpr const char* kGap = "  ";
constexpr std::size_t kGapWidth = 2;

/// The rows with a header of two lines: a title of several words is broken at the space that gives the
/// shortest lines.
Rows withTwoLines(const Rows& rows) {
  Rows broken{rows.front(), rows.front()};
  for (std::size_t c = 0; c < rows.front().size(); ++c) {
    const std::string& title = rows.front()[c];
    std::size_t best = std::string::npos, least = title.size();
    for (std::size_t at = title.find(' '); at != std::string::npos; at = title.find(' ', at + 1)) {
      const std::size_t longer = std::max(at, title.size() - at - 1);
      if (longer < least) best = at, least = longer;
    }
    broken[0][c] = best == std::string::npos ? "" : title.substr(0, best);
    broken[1][c] = best == std::string::npos ? title : title.substr(best + 1);
  }
  broken.insert(broken.end(), rows.begin() + 1, rows.end());
  return broken;
}

/// A text of at most so many characters, with its begin and its end.
std::string shortened(const std::string& text, std::size_t width) {
  const std::size_t end = (width - 3) / 2, begin = width - 3 - end;
  return text.size() <= width ? text
                              : text.substr(0, begin) + "..." + text.substr(text.size() - end);
}

std::vector<std::size_t> widthsOf(const Rows& rows, std::size_t widestFirst) {
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const auto& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c)
      if (c > 0 || row[c].size() <= widestFirst) widths[c] = std::max(widths[c], row[c].size());
  return widths;
}

std::size_t sumOf(const std::vector<std::size_t>& widths) {
  std::size_t sum = 0;
  for (const std::size_t width : widths) sum += width + kGapWidth;
  return sum - kGapWidth;
}

/// Prints the first column and those from `first` to before `end`.
void printPart(const Rows& rows, const std::vector<std::size_t>& widths, std::size_t first,
               std::size_t end, std::ostream& out) {
  for (const auto& row : rows) {
    const bool isLong = row[0].size() > widths[0];
    if (isLong) out << row[0] << '\n';
    out << padded(isLong ? "" : row[0], widths[0], true);
    for (std::size_t c = first; c < end; ++c) out << kGap << padded(row[c], widths[c], false);
    out << '\n';
  }
}

}  // namespace

void Table::print(std::ostream& out) const {
  const std::size_t columns = rows_.front().size();
  printPart(rows_, widthsOf(rows_, std::string::npos), 1, columns, out);
}

void Table::print(std::ostream& out, std::size_t width) const {
  const std::size_t columns = rows_.front().size();
  if (sumOf(widthsOf(rows_, std::string::npos)) <= width) return print(out);
  Rows rows = withTwoLines(rows_);
  for (auto& row : rows) row[0] = printable(shortened(row[0], width));
  const std::vector<std::size_t> widths = widthsOf(rows, width / 3);
  for (std::size_t first = 1; first < columns;) {
    std::size_t end = first, taken = widths[0];
    while (end < columns && (end == first || taken + kGapWidth + widths[end] <= width))
      taken += kGapWidth + widths[end++];
    if (first > 1) out << '\n';
    printPart(rows, widths, first, end, out);
    first = end;
  }
}

std::string formatted(const char* format, double value) {
  char text[400];  // fixed notation of any double
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string exactNumber(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string decibels(double value) {
  return std::isinf(value) ? "exact" : formatted("%.2f", value);
}
std::pair<std::string, std::string> decibelsApart(double value, double other) {
  if (std::isinf(value) || std::isinf(other)) return {decibels(value), decibels(other)};
  return textsApart(value, other, "%.*f", 2);
}

std::string shortNumber(double value) { return formatted("%.4g", value); }

std::pair<std::string, std::string> shortNumbersApart(double value, double other) {
  return textsApart(value, other, "%.*g", 4);
}

std::string completeOf(std::uint64_t done, std::uint64_t all, const std::string& thing) {
  return std::to_string(done) + " of " + counted(all, thing) + (done == 1 ? " is" : " are") +
         " complete";
}

std::string seconds(double value) { return formatted("%.1f", value); }

std::string textOf(const Box& box) {
  return box.empty() ? "empty" : toString(box.min) + " to " + toString(box.max);
}

void printMetadata(const std::string& title, const std::vector<MetaItem>& items,
                   std::ostream& out) {
  for (const auto& item : items)
    out << printable(title + ": " + item.name + " (" + item.type + ")") << '\n';
}

std::string shellWord(const std::string& word) {
  const bool plain =
      !word.empty() &&
      word.find_first_not_of(
          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=,:+%") ==
          std::string::npos;
  if (plain) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

// ---- The main function of a program

Error currentFailure() {
  try {
    throw;
  } catch (const Error& error) {
    return error;
  } catch (const std::bad_alloc&) {
    return {ErrorKind::kDevice, "out of memory"};
  } catch (const std::exception& error) {
    return {ErrorKind::kRuntime, error.what()};
  }
}

namespace {

int runAndFlush(const std::function<int()>& body) {
  const int code = body();
  std::cout.flush();
  if (!std::cout) throw RuntimeFailure("cannot write to standard output");
  return code;
}

}  // namespace

int runMain(const std::string& program, const std::function<int()>& body) {
  const auto complain = [&](const std::string& text) {
    std::cerr << program << ": " << printableMessage(text) << '\n';
  };
  keepStandardDescriptors();
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on file sizes then gives an error, not a signal
  try {
    return runAndFlush(body);
  } catch (const Cancelled& error) {
    complain("interrupted; nothing was written");
    return error.exitCode();
  } catch (const MemoryExceeded& error) {
    complain(error.what());
    std::cerr << "The option --max-memory allows more.\n";
    return error.exitCode();
  } catch (...) {
    const Error error = currentFailure();
    complain(error.what());
    if (error.kind() == ErrorKind::kUsage)
      std::cerr << "Try '" << program << " --help' for more information.\n";
    return error.exitCode();
  }
}

// Signals.

namespace {

std::atomic<CancelToken*> signalled{nullptr};
std::atomic<int> wakened{-1};
static_assert(std::atomic<CancelToken*>::is_always_lock_free, "read by a signal handler");
static_assert(std::atomic<int>::is_always_lock_free, "read by a signal handler");

void wake(int event) {
  const std::uint64_t one = 1;
  (void)!::write(event, &one, sizeof one);
}

extern "C" void cancelSignalled(int) {
  const int error = errno;
  if (CancelToken* token = signalled.load()) token->cancel();
  wake(wakened.load());
  errno = error;
}

void tell(std::string_view line) { (void)!::write(STDERR_FILENO, line.data(), line.size()); }

/// Waits until the event is signalled. \return false after this number of milliseconds; -1: never
bool await(int event, int milliseconds) {
  pollfd wanted{event, POLLIN, 0};
  return ::poll(&wanted, 1, milliseconds) > 0;
}

}  // namespace

Interrupts::Interrupts(FurtherSignals further) : event_(::eventfd(0, EFD_CLOEXEC)) {
  if (event_ < 0) throw RuntimeFailure("cannot watch for signals: too many open files");
  CancelToken* none = nullptr;
  if (!signalled.compare_exchange_strong(none, &token_)) {
    ::close(event_);
    throw std::logic_error("two cli::Interrupts at a time");
  }
  wakened.store(event_);
  sigset_t all, before;  // the watcher handles no signal
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  watcher_ = std::thread([this] { watch(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  struct sigaction action {};
  action.sa_handler = cancelSignalled;
  action.sa_flags = SA_RESTART;
  if (further == FurtherSignals::kEndAtOnce) action.sa_flags |= int(SA_RESETHAND);
  sigaction(SIGINT, &action, &previousInt_);
  sigaction(SIGTERM, &action, &previousTerm_);
}

Interrupts::~Interrupts() {
  sigaction(SIGINT, &previousInt_, nullptr);
  sigaction(SIGTERM, &previousTerm_, nullptr);
  ended_ = true;
  wake(event_);
  watcher_.join();
  signalled.store(nullptr);
  wakened.store(-1);
  ::close(event_);
}

void Interrupts::watch() const {
  using Clock = std::chrono::steady_clock;
  while (!await(event_, -1)) {
  }
  const auto end = Clock::now() + std::chrono::duration<double>(kSecondsToEnd);
  constexpr int kInterval = 20;  // milliseconds
  bool isTold = false;
  while (!ended_) {
    ::poll(nullptr, 0, kInterval);
    if (ended_ || Clock::now() < end) continue;
    if (!token_.completing()) {
      tell("interrupted; the run was ended before it could end by itself; nothing was written\n");
      std::_Exit(int(ErrorKind::kRuntime));
    }
    if (!isTold)
      tell("interrupted; the best result so far is being completed; another Ctrl-C gives it up\n");
    isTold = true;
  }
}

}  // namespace esvr::cli
