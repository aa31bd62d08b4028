#pragma once
/// Errors of the library. Every failure is thrown as esvr::Error or a class derived from it and is
/// caught once, in a program's main(), where kind() becomes the exit code. Texts name the file, the
/// grid and the voxel as far as they are known.

#include <stdexcept>
#include <string>

namespace esvr {

/// The kind of a failure; the value is the exit code of the programs.
enum class ErrorKind {
  kRuntime = 1,       ///< the run failed: output not writable, disk full, cancelled
  kUsage = 2,         ///< options that make no sense
  kBadInput = 3,      ///< the input cannot be used: missing, damaged, nothing to fit
  kTargetMissed = 4,  ///< a quality target was not reached, or a comparison failed
  kDevice = 5         ///< the device is missing, or memory is not enough
};

class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& what) : std::runtime_error(what), kind_(kind) {}
  [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }
  [[nodiscard]] int exitCode() const noexcept { return static_cast<int>(kind_); }

 private:
  ErrorKind kind_;
};

struct RuntimeFailure : Error {
  explicit RuntimeFailure(const std::string& what) : Error(ErrorKind::kRuntime, what) {}
};
struct UsageError : Error {
  explicit UsageError(const std::string& what) : Error(ErrorKind::kUsage, what) {}
};
struct BadInput : Error {
  explicit BadInput(const std::string& what) : Error(ErrorKind::kBadInput, what) {}
};
struct TargetMissed : Error {
  explicit TargetMissed(const std::string& what) : Error(ErrorKind::kTargetMissed, what) {}
};
struct DeviceError : Error {
  explicit DeviceError(const std::string& what) : Error(ErrorKind::kDevice, what) {}
};
/// The input asks for more memory than is allowed. The text says how much it needs.
struct MemoryExceeded : Error {
  explicit MemoryExceeded(const std::string& what) : Error(ErrorKind::kDevice, what) {}
};
/// Thrown where a CancelToken (progress.h) was set and no partial result was asked for.
struct Cancelled : Error {
  Cancelled() : Error(ErrorKind::kRuntime, "cancelled") {}
};

}  // namespace esvr
