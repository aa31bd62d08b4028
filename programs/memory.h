#pragma once
/// The memory of a program: what the machine has, the options --max-memory and --scratch, and the
/// shares of tasks.

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>

#include "esvr/device.h"
#include "esvr/volume.h"
#include "programs/command_line.h"

namespace esvr::cli {

/// Bytes of physical memory.
[[nodiscard]] std::uint64_t physicalMemory();

/// Bytes that the process can still allocate before the system has to swap, or before a limit of
/// its control group or of its address space is reached.
[[nodiscard]] std::uint64_t availableMemory();

/// The largest amount of memory that the process has held, in bytes.
[[nodiscard]] std::uint64_t peakMemory();

/// Measures by how much the memory of the process grows during a step.
class MemoryMeter {
 public:
  /// Starts a step. It returns free memory to the system and resets the system's record of the
  /// peak.
  MemoryMeter();
  /// The growth in bytes; nothing if the system keeps no such record.
  [[nodiscard]] std::optional<std::uint64_t> peakRise() const;

 private:
  std::optional<std::uint64_t> before_;
};

// The options --max-memory and --scratch.

/// The memory of the host that a program may take.
struct HostMemory {
  std::uint64_t maxBytes = kNoMemoryLimit;  ///< voxels in files do not count
  VoxelMemory voxels{};                     ///< holds voxels in files if they need a large share
};

/// Adds the options.
void addHostMemory(CommandLine& line);

/// The limit, which is the value of --max-memory or a share of the memory that is available, and
/// files in the folder of --scratch.
/// \throws UsageError  the value is not a size, or the folder does not exist
[[nodiscard]] HostMemory hostMemoryOf(const Arguments& arguments);

/// The folder of --scratch, or that of the variable TMPDIR, or /var/tmp: /tmp is in memory on many
/// systems.
/// \throws UsageError  the folder does not exist
[[nodiscard]] std::filesystem::path scratchFolderOf(const Arguments& arguments);

/// The same without options.
[[nodiscard]] std::filesystem::path scratchFolder();

// Tasks on several threads begin only while there is memory for them.

/// An amount of memory that tasks share. They take their parts in the order in which they ask, so
/// that a large task does not wait forever.
class MemoryGate {
 public:
  explicit MemoryGate(std::uint64_t bytes) : all_(bytes) {}

  /// The memory of a task. It is given back when the object goes out of scope.
  class Part {
   public:
    Part(MemoryGate& gate, std::uint64_t bytes) : gate_(gate), bytes_(bytes) {}
    ~Part() { gate_.giveBack(bytes_); }
    Part(const Part&) = delete;
    Part& operator=(const Part&) = delete;

   private:
    MemoryGate& gate_;
    std::uint64_t bytes_;
  };

  /// Waits until there is enough memory. A task that needs more than there is runs alone.
  [[nodiscard]] Part take(std::uint64_t bytes);
  [[nodiscard]] Part takeAll() { return take(all_); }

 private:
  void giveBack(std::uint64_t bytes);

  const std::uint64_t all_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t taken_ = 0;
  std::uint64_t nextTicket_ = 0, served_ = 0;
};

}  // namespace esvr::cli
