#include "cli/memory.h"

#include <sys/resource.h>
#include <unistd.h>

namespace esvr::cli {

std::uint64_t physicalMemory() {
  return std::uint64_t(sysconf(_SC_PHYS_PAGES)) * std::uint64_t(sysconf(_SC_PAGESIZE));
}

std::uint64_t peakMemory() {
  constexpr std::uint64_t kUnit = 1024;  // of ru_maxrss on Linux
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::uint64_t(usage.ru_maxrss) * kUnit;
}

}  // namespace esvr::cli
