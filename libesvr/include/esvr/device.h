#pragma once
/// Where a call computes, how it is cancelled, and how much memory it may take.

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace esvr {

enum class DeviceKind { kCpu, kCuda };

struct Device {
  DeviceKind kind = DeviceKind::kCpu;
  int index = 0;  ///< number of the CUDA device
  friend bool operator==(const Device&, const Device&) = default;
};

/// Is told that a device failed and is not used any more, and why, while other devices go on. It may be
/// called on any thread.
using LostDevice = std::function<void(const Device& device, const std::string& why)>;

/// True if the library was built with CUDA, whether or not the machine has a GPU.
[[nodiscard]] bool builtWithCuda() noexcept;

/// Selects a device by name: "auto", "cpu", "cuda" or "cuda:N". "auto" selects a CUDA device if one
/// is usable, otherwise the CPU.
/// \throws UsageError   the text is none of these names
/// \throws DeviceError  the CUDA device cannot be used (the text says why)
[[nodiscard]] Device selectDevice(const std::string& text);

/// Selects one or more devices: "cuda:0,1,3" (each number may be repeated), "cuda:all" (all usable
/// CUDA devices), or a name that selectDevice() takes.
/// \return at least one device
/// \throws UsageError, DeviceError  see selectDevice()
[[nodiscard]] std::vector<Device> selectDevices(const std::string& text);

/// Starts a device, which takes some tenths of a second for a GPU, so that its first use need not
/// wait. It may be called on another thread. It reports no error, because the first use does.
void startDevice(const Device& device) noexcept;

/// Free memory of a GPU in bytes; 0 for the CPU.
/// \throws DeviceError  the GPU cannot be used
[[nodiscard]] std::uint64_t freeDeviceMemory(const Device& device);

/// The name of a device: "CPU", or the GPU's name and number, "NVIDIA H200 (cuda:0)".
[[nodiscard]] std::string deviceName(const Device& device);

/// Versions for --version: "CUDA 13.0, driver 580.159", or "no CUDA".
[[nodiscard]] std::string cudaVersions();

// Limits on the memory that an input may need.

/// The value of a limit that allows any amount of memory.
inline constexpr std::uint64_t kNoMemoryLimit = std::numeric_limits<std::uint64_t>::max();

/// The limit of interfaces whose callers name none: half of the memory of the machine, so that a small
/// file that asks for more is refused before the machine swaps; no limit where the system does not tell.
[[nodiscard]] std::uint64_t usualMemoryLimit();

/// Checks an amount of memory against a limit.
/// \param what  subject of the message, for example "grid 'density'"
/// \throws MemoryExceeded  neededBytes is more than maxBytes; the text gives both numbers
void requireWithinMemory(double neededBytes, std::uint64_t maxBytes, const std::string& what);

// Cancels long calls.
//
// A CancelToken is set by another thread or by a signal handler. A CancelScope makes it the token of
// the calling thread, and every long loop of the library looks at the token of its thread: loops over
// bricks, voxels, ellipsoids, rows and pieces of files, and the trials of a search. A loop whose token
// is set throws Cancelled. The loops of the library that use several threads give their tasks the
// token of the thread that began them; a program that starts threads of its own opens a CancelScope in
// each. Calls with a token in their options (FitOptions::cancel, RenderOptions::cancel) open one
// themselves.
//
// A call that has a part of its result when it is cancelled may return the best result so far instead
// (fit.h, encode.h). It completes this result in a BestSoFar, where no loop is cancelled.

/// A flag that another thread or a signal handler sets to stop a long call at its next safe point.
/// It belongs to the caller.
class CancelToken {
 public:
  CancelToken() = default;
  /// A token for a part of a call. \param whole  the token of the call, which cancels this part too;
  ///                                             it may be null and must outlive this one
  explicit CancelToken(const CancelToken* whole) : whole_(whole) {}
  CancelToken(const CancelToken&) = delete;
  CancelToken& operator=(const CancelToken&) = delete;
  virtual ~CancelToken() = default;

  void cancel() noexcept { flag_.store(true, std::memory_order_relaxed); }
  /// It is called on many threads, thousands of times a second.
  [[nodiscard]] virtual bool cancelled() const noexcept {
    return flag_.load(std::memory_order_relaxed) || (whole_ && whole_->cancelled());
  }

  /// Says that nobody wants the best result so far of a call that is cancelled. It then throws Cancelled.
  void discardResults() noexcept { discards_ = true; }
  [[nodiscard]] bool discardsResults() const noexcept {
    return discards_ || (whole_ && whole_->discardsResults());
  }

  /// True while a Completion exists that was begun under this token or under one for a part.
  [[nodiscard]] bool completing() const noexcept { return completions_.load() > 0; }

 private:
  friend class Completion;
  void addCompletions(int number) const noexcept {
    completions_ += number;
    if (whole_) whole_->addCompletions(number);
  }

  const CancelToken* whole_ = nullptr;
  std::atomic<bool> flag_{false};
  std::atomic<bool> discards_{false};
  mutable std::atomic<int> completions_{0};
  static_assert(std::atomic<bool>::is_always_lock_free, "cancel() is called from signal handlers");
};

/// Makes a token the one of the calling thread, as long as it lives. Scopes of a thread end in the
/// reverse order of their beginnings.
class CancelScope {
 public:
  /// \param token  null: nothing cancels the loops; it must outlive the scope
  explicit CancelScope(const CancelToken* token) noexcept;
  ~CancelScope();
  CancelScope(const CancelScope&) = delete;
  CancelScope& operator=(const CancelScope&) = delete;

  /// The token of the calling thread; null if it has none.
  [[nodiscard]] static const CancelToken* token() noexcept;
  /// The given token, or that of the calling thread if the given one is null.
  [[nodiscard]] static const CancelToken* orToken(const CancelToken* given) noexcept {
    return given ? given : token();
  }
  [[nodiscard]] static bool cancelled() noexcept {
    const CancelToken* own = token();
    return own && own->cancelled();
  }
  /// \throws Cancelled  the token of the calling thread is set
  static void check();

 private:
  const CancelToken* outer_;
};

/// As long as it lives, the loops of the calling thread are not cancelled, so that a result that is
/// there can be completed. What is done meanwhile should take less than a second, since the one who has
/// cancelled waits for it.
class Completion {
 public:
  Completion() noexcept : Completion(true) {}
  ~Completion() {
    if (token_) token_->addCompletions(-1);
  }
  Completion(const Completion&) = delete;
  Completion& operator=(const Completion&) = delete;

 protected:
  /// \param isWanted  false: the loops are cancelled as before
  explicit Completion(bool isWanted) noexcept
      : token_(isWanted ? CancelScope::token() : nullptr),
        scope_(isWanted ? nullptr : CancelScope::token()) {
    if (token_) token_->addCompletions(1);
  }

 private:
  const CancelToken* token_;
  CancelScope scope_;
};

/// The completion of the best result so far, unless the token discards it.
class BestSoFar : public Completion {
 public:
  BestSoFar() noexcept : Completion(isWanted(CancelScope::token())) {}

 private:
  [[nodiscard]] static bool isWanted(const CancelToken* token) noexcept {
    return !token || !token->discardsResults();
  }
};

}  // namespace esvr
