#include "cli/host_memory.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include "cli/byte_size.h"
#include "cli/memory.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

constexpr const char* kMaxMemory = "max-memory";
constexpr const char* kScratch = "scratch";
constexpr double kShare = 0.75;  // the rest is left to other programs

/// A source and its copy, with half of the memory for the work on them.
constexpr std::uint64_t kVolumesInMemory = 4;

std::uint64_t maxBytesOf(const Arguments& arguments) {
  if (const auto size = arguments.find<std::string>(kMaxMemory))
    return parseByteSize(kMaxMemory, *size);
  return std::uint64_t(kShare * double(availableMemory()));
}

/// The default is not the folder for temporary files, /tmp, which is in memory on many systems.
std::filesystem::path scratchOf(const Arguments& arguments) {
  namespace fs = std::filesystem;
  const char* variable = std::getenv("TMPDIR");
  const fs::path usual = variable && *variable ? variable : "/var/tmp";
  const auto given = arguments.find<std::string>(kScratch);
  if (given && !fs::is_directory(*given))
    throw UsageError("--" + std::string(kScratch) + ": " + *given + " is not a folder");
  return given ? fs::path(*given) : usual;
}

}  // namespace

void addHostMemory(CommandLine& line) {
  line.options().add_options()(
      kMaxMemory, po::value<std::string>()->value_name("SIZE"),
      "memory that may be taken, for example 8GB (default: 3/4 of the memory that is available); "
      "voxels that need more than a quarter of it are kept in a file; input that needs more "
      "nevertheless is refused with exit code 5, as far as this can be estimated before the work "
      "begins")(kScratch, po::value<std::string>()->value_name("DIR"),
                "folder for the file that holds voxels which do not fit into memory (default: "
                "$TMPDIR, or /var/tmp)");
}

HostMemory hostMemoryOf(const Arguments& arguments) {
  const std::uint64_t maxBytes = maxBytesOf(arguments), share = maxBytes / kVolumesInMemory;
  return {maxBytes, VoxelMemory({scratchOf(arguments), share, share})};
}

}  // namespace esvr::cli
