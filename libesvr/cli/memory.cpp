#include "cli/memory.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <string>

namespace esvr::cli {
namespace {

constexpr std::uint64_t kUnit = 1024;  // of the system's figures

/// A line of /proc/self/status.
std::optional<std::uint64_t> statusBytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::uint64_t value = 0;
    if (word == key && status >> value) return value * kUnit;
  }
  return std::nullopt;
}

}  // namespace

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
  constexpr const char* kResetPeak = "5";  // proc(5), clear_refs
  std::ofstream record("/proc/self/clear_refs");
  if (record << kResetPeak << std::flush) before_ = statusBytes("VmRSS:");
}

std::optional<std::uint64_t> MemoryMeter::peakRise() const {
  const auto peak = statusBytes("VmHWM:");
  if (!before_ || !peak) return std::nullopt;
  return *peak > *before_ ? *peak - *before_ : 0;
}

}  // namespace esvr::cli
