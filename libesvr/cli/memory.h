#pragma once
/// How much memory the machine has and the process takes.

#include <cstdint>
#include <optional>

namespace esvr::cli {

/// Bytes of physical memory.
[[nodiscard]] std::uint64_t physicalMemory();

/// Bytes that the process can still allocate before the system has to swap, or before a limit of
/// its control group or of its address space is reached.
[[nodiscard]] std::uint64_t availableMemory();

/// Bytes of the most memory that the process has held at once.
[[nodiscard]] std::uint64_t peakMemory();

/// Measures the memory that one step of a run holds at most, beyond what was held before it.
class MemoryMeter {
 public:
  /// Begins a step: gives what is free back to the system, and resets the system's own record.
  MemoryMeter();
  /// Bytes; nothing where the system keeps no such record.
  [[nodiscard]] std::optional<std::uint64_t> peakRise() const;

 private:
  std::optional<std::uint64_t> before_;
};

}  // namespace esvr::cli
