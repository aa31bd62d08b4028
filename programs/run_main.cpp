// How a program runs and ends: errors and exit codes, Ctrl-C and SIGTERM.
#include "programs/run_main.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <stdexcept>
#include <string_view>

#include "core/atomic_file.h"
#include "esvr/error.h"
#include "programs/messages.h"

namespace esvr::cli {

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
