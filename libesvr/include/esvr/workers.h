#pragma once
/// Who runs the parts of a fit in chunks: the devices of this process, or those of several processes that MPI
/// has started. A folder may keep the results of parts.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/device.h"
#include "esvr/fit.h"

namespace esvr {

// A folder with the results of the parts of a fit in chunks, which the ranks of MPI may share.
//
// The name of a result is the hash of all that it depends on (PartKey). A run that is started again
// finds the results that are there and computes the same fit from them. A process that uses the
// folder holds a lock on it, which the system releases when the process ends for any reason.

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

// Runs the parts of a fit in chunks on several devices of this process.

class WorkingDevices;

/// A thread for each device takes one part after the other.
class DeviceWorkers : public PartRunner {
 public:
  /// \param devices  at least one. If the CPU is listed twice, it runs two parts at the same time;
  ///                 if a GPU is, a part is prepared on the host while the GPU fits another one
  /// \param onLost   is told when a device fails and the others do its parts; it may be empty
  /// \param store    holds the results of parts, which are not fitted again; may be null
  explicit DeviceWorkers(std::vector<Device> devices, LostDevice onLost = {},
                         PartStore* store = nullptr);
  ~DeviceWorkers() override;

  /// \throws DeviceError  all devices have failed
  /// \throws BadInput  a result in the store is damaged
  /// \throws Error  what else a part threw; the other devices end their current parts first
  std::vector<std::vector<std::byte>> run(const RoundParts& parts) override;

 private:
  std::vector<Device> devices_;
  std::unique_ptr<WorkingDevices> working_;
  PartStore* store_;
};

// The processes that `mpirun -n N` or `srun -n N` has started together.

/// The processes are called ranks. All ranks call agree(), handOut() and exchange() in the same
/// order. The destructor waits for all ranks, unless allEnd() has done so.
class Ranks {
 public:
  using Bytes = std::vector<std::byte>;

  virtual ~Ranks() = default;

  [[nodiscard]] virtual int rank() const = 0;   ///< number of this rank, from 0
  [[nodiscard]] virtual int count() const = 0;  ///< number of ranks
  [[nodiscard]] virtual int rankOnHost()
      const = 0;  ///< number among the ranks of this host, from 0

  /// \return whether a number is the same on all ranks
  [[nodiscard]] virtual bool agree(std::uint64_t number) = 0;

  /// Begins to hand out the numbers from 0 to count - 1 to the ranks that ask for them.
  virtual void handOut(std::size_t count) = 0;
  /// A number that no other rank gets; nothing if none is left. Any thread may call it, and every
  /// rank calls it until none is left.
  [[nodiscard]] virtual std::optional<std::size_t> next() = 0;

  /// Gives all ranks the results of all numbers. \param own  results of the numbers of this rank
  [[nodiscard]] virtual std::vector<Bytes> exchange(std::vector<std::optional<Bytes>> own) = 0;

  /// Tells the other ranks that this one ends after a failure, and waits until all have told so. A rank
  /// that failed alone must then abort the others, which would wait for it.
  /// \return false if some have not told it within this time
  [[nodiscard]] virtual bool allEnd(double seconds) = 0;

  /// Ends all ranks now.
  [[noreturn]] virtual void abort(int exitCode) = 0;
};

/// Joins the ranks that this process was started with.
/// \return null if it was not started as one of several
/// \throws RuntimeFailure  it was, but this build has no MPI, or MPI cannot be used
[[nodiscard]] std::unique_ptr<Ranks> joinRanks();

// Runs the parts of a fit in chunks on the devices of several ranks.

class RankWorkers : public PartRunner {
 public:
  /// \param devices  devices of this rank, at least one
  /// \param store    keeps the results of parts; it may be null
  RankWorkers(Ranks& ranks, std::vector<Device> devices, PartStore* store);

  /// \throws RuntimeFailure  the ranks do not have the same parts
  /// \throws Error           what a part of this rank threw; the ranks must then be aborted
  std::vector<std::vector<std::byte>> run(const RoundParts& parts) override;

 private:
  Ranks& ranks_;
  std::vector<Device> devices_;
  PartStore* store_;
};

}  // namespace esvr
