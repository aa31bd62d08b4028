#pragma once
/// The memory of the machine and of the process.

#include <cstdint>
#include <optional>

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

}  // namespace esvr::cli
