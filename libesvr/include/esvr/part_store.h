#pragma once
/// A folder with the results of the parts of a fit in chunks, which the ranks of MPI may share.
///
/// The name of a result is the hash of all that it depends on (PartKey). A run that is started again
/// finds the results that are there and computes the same fit from them. A process that uses the
/// folder holds a lock on it, which the system releases when the process ends for any reason.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/part_runner.h"

namespace esvr {

/// A property of the run that made a folder, for example {"input", "/data/smoke.vdb"}.
struct PartOrigin {
  std::string name, value;
};

class PartStore {
 public:
  enum class Access { kAlone, kShared };

  /// Creates the folder, or opens one that a run with the same origin has made.
  /// \throws BadInput  the folder has another origin; the text names both
  /// \throws RuntimeFailure  another process uses the folder (kAlone: at all, kShared: alone), or
  ///                         it cannot be written
  PartStore(std::filesystem::path folder, const std::vector<PartOrigin>& origin, Access access);

  /// The result of a part; nothing if it is not there.
  /// \throws BadInput  the result is damaged
  [[nodiscard]] std::optional<std::vector<std::byte>> find(const PartKey& key) const;

  /// Writes a result. The file appears under its name only when it is complete.
  /// \throws RuntimeFailure  it cannot be written
  void put(const PartKey& key, std::span<const std::byte> result);

  /// A lock on a file, which the destructor releases.
  class Lock {
   public:
    explicit Lock(int fd) : fd_(fd) {}
    Lock(Lock&& other) noexcept;
    Lock& operator=(Lock&&) = delete;
    ~Lock();

   private:
    int fd_;
  };

  /// Removes all results, and the folder unless it has files that this class has not made.
  void remove();

 private:
  void checkOrigin(const std::vector<PartOrigin>& origin) const;
  [[nodiscard]] std::filesystem::path fileOf(const PartKey& key) const;

  std::filesystem::path folder_;
  Lock lock_;
};

}  // namespace esvr
