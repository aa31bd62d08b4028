#pragma once
/// A folder with the results of the parts of a fit in chunks, which several processes may share.
///
/// The name of a result is the hash of all that it depends on (PartKey). A process that is started
/// again, or that shares the folder, finds the results that are there and computes the same fit from
/// them. A process that fits a part holds a lock on it. The system releases the lock when the
/// process ends for any reason, and another process can then fit the part.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "esvr/device.h"
#include "esvr/part_runner.h"
#include "esvr/progress.h"

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

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

  [[nodiscard]] bool contains(const PartKey& key) const;

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

  /// The lock on a part. The destructor removes its file.
  class Claim {
   public:
    Claim(std::filesystem::path path, Lock lock) : path_(std::move(path)), lock_(std::move(lock)) {}
    Claim(Claim&& other) noexcept
        : path_(std::exchange(other.path_, {})), lock_(std::move(other.lock_)) {}
    Claim& operator=(Claim&&) = delete;
    ~Claim();

   private:
    std::filesystem::path path_;
    Lock lock_;
  };
  /// \return nothing if another process fits the part
  [[nodiscard]] std::optional<Claim> claim(const PartKey& key);

  /// Removes all results, and the folder unless it has files that this class has not made.
  void remove();

 private:
  void checkOrigin(const std::vector<PartOrigin>& origin) const;
  [[nodiscard]] std::filesystem::path fileOf(const PartKey& key, const char* extension) const;

  std::filesystem::path folder_;
  Lock lock_;
};

/// The K-th of N processes that share the parts of a fit, K from 1 to N.
struct PartShare {
  int number = 1, count = 1;
};

struct StoredPartsOptions {
  std::vector<Device> devices;  ///< at least one
  /// The process begins with its share of the parts of a round. It then fits those of other
  /// processes that have not been begun, and waits for those that have.
  PartShare share{};
  bool mergeOnly = false;  ///< parts are not fitted; all must be there
  const CancelToken* cancel = nullptr;
  LostDevice
      onLost{};  ///< is told when a device fails and the others do its parts; it may be empty
};

/// Takes the results of parts from a store, and fits those that are not there.
class StoredParts : public PartRunner {
 public:
  /// \param store  must outlive this
  StoredParts(PartStore& store, StoredPartsOptions options);

  /// \throws BadInput  with mergeOnly: results are missing
  /// \throws Error     what a part threw
  std::vector<std::vector<std::byte>> run(const RoundParts& parts) override;

 private:
  void requireAll(const RoundParts& parts) const;

  PartStore& store_;
  StoredPartsOptions options_;
};

}  // namespace esvr
