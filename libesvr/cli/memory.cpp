#include "cli/memory.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace esvr::cli {
namespace {

constexpr std::uint64_t kUnit = 1024;  // unit of the system's figures

/// Reads a line of one of the system's tables.
std::optional<std::uint64_t> bytesIn(const char* table, const std::string& key) {
  std::ifstream lines(table);
  for (std::string word; lines >> word;) {
    std::uint64_t value = 0;
    if (word == key && lines >> value) return value * kUnit;
  }
  return std::nullopt;
}

std::optional<std::uint64_t> statusBytes(const std::string& key) {
  return bytesIn("/proc/self/status", key);
}

/// Reads a file that holds one number; nothing if it holds a word such as "max" or does not exist.
std::optional<std::uint64_t> numberIn(const char* path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  return file >> value ? std::optional(value) : std::nullopt;
}

std::uint64_t difference(std::uint64_t limit, std::uint64_t held) {
  return limit > held ? limit - held : 0;
}

/// The memory that the limit of the process's control group (container) leaves.
std::uint64_t leftInGroup() {
  const auto limit = numberIn("/sys/fs/cgroup/memory.max");
  if (!limit) return std::numeric_limits<std::uint64_t>::max();
  return difference(*limit, numberIn("/sys/fs/cgroup/memory.current").value_or(0));
}

std::uint64_t leftInAddressSpace() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return std::numeric_limits<std::uint64_t>::max();
  return difference(limit.rlim_cur, statusBytes("VmSize:").value_or(0));
}

}  // namespace

std::uint64_t availableMemory() {
  const auto free = bytesIn("/proc/meminfo", "MemAvailable:").value_or(physicalMemory());
  return std::min({free, leftInGroup(), leftInAddressSpace()});
}

std::uint64_t physicalMemory() {
  return std::uint64_t(sysconf(_SC_PHYS_PAGES)) * std::uint64_t(sysconf(_SC_PAGESIZE));
}

std::uint64_t peakMemory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::uint64_t(usage.ru_maxrss) * kUnit;
}

MemoryMeter::MemoryMeter() {
  malloc_trim(0);
  constexpr const char* kResetPeak = "5";  // see proc(5), clear_refs
  std::ofstream record("/proc/self/clear_refs");
  if (record << kResetPeak << std::flush) before_ = statusBytes("VmRSS:");
}

std::optional<std::uint64_t> MemoryMeter::peakRise() const {
  const auto peak = statusBytes("VmHWM:");
  if (!before_ || !peak) return std::nullopt;
  return *peak > *before_ ? *peak - *before_ : 0;
}

}  // namespace esvr::cli
