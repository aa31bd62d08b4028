#pragma once
/// Errors of the library. Every failure is thrown as esvr::Error or a class derived from it. A
/// program catches it once, in main(), and exits with the code of kind(). The text names the file,
/// the grid and the voxel if they are known.

#include <stdexcept>
#include <string>

namespace esvr {

/// The kind of a failure; its value is the exit code of the programs.
enum class ErrorKind {
  kRuntime = 1,       ///< the run failed: output not writable, disk full, cancelled
  kUsage = 2,         ///< invalid options
  kBadInput = 3,      ///< unusable input: missing, damaged, nothing to fit
  kTargetMissed = 4,  ///< a quality target was not reached, or a comparison failed
  kDevice = 5         ///< the device is missing, or memory is insufficient
};

class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& what)
      : std::runtime_error(what), kind_(kind), text_(what) {}
  [[nodiscard]] const char* what() const noexcept override { return text_.c_str(); }
  [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }
  [[nodiscard]] int exitCode() const noexcept { return static_cast<int>(kind_); }
  /// Gives a grid that the text names the name by which users find it, if that is another one.
  /// \param stored  shownName() of its descriptor. \param unique  as of GridNames
  void nameGrid(const std::string& stored, const std::string& unique) {
    for (const char quote : {'\'', '"'}) {
      const std::string quoted = quote + stored + quote;
      if (const auto at = text_.find(quoted); at != std::string::npos && stored != unique)
        text_.replace(at + 1, stored.size(), unique);
    }
  }
  /// Puts the name of a file before a text that does not have it.
  void nameFile(const std::string& path) {
    if (text_.find(path) == std::string::npos) text_ = path + ": " + text_;
  }

 private:
  ErrorKind kind_;
  std::string text_;
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
/// Input that is sound, but that a conversion cannot represent, such as voxels that are 2^31 apart. A
/// .vdb grid of this kind can still be carried unchanged (grid.h).
struct CannotConvert : BadInput {
  explicit CannotConvert(const std::string& what) : BadInput(what) {}
};
/// Voxels that are NaN, infinite or too large for float. A reader can replace them (NonFinite, vdb_io.h).
struct NotFinite : CannotConvert {
  explicit NotFinite(const std::string& what) : CannotConvert(what) {}
};
struct TargetMissed : Error {
  explicit TargetMissed(const std::string& what) : Error(ErrorKind::kTargetMissed, what) {}
};
struct DeviceError : Error {
  explicit DeviceError(const std::string& what) : Error(ErrorKind::kDevice, what) {}
};
/// The input needs more memory than is allowed. The text says how much it needs.
struct MemoryExceeded : Error {
  explicit MemoryExceeded(const std::string& what) : Error(ErrorKind::kDevice, what) {}
};
/// A CancelToken (device.h) was set, and there is no partial result to return.
struct Cancelled : Error {
  Cancelled() : Error(ErrorKind::kRuntime, "cancelled") {}
};

/// Runs what works on the content of a file. Its errors name the file, which functions on volumes do not know, but for those of
/// a device and of an interrupted run.
template <typename Action>
auto namingFile(const std::string& path, const Action& action) {
  try {
    return action();
  } catch (UsageError& error) {
    error.nameFile(path);
    throw;
  } catch (BadInput& error) {
    error.nameFile(path);
    throw;
  } catch (MemoryExceeded& error) {
    error.nameFile(path);
    throw;
  }
}

}  // namespace esvr
