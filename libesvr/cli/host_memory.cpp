#include "cli/host_memory.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include "cli/byte_size.h"
#include "cli/memory.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

namespace fs = std::filesystem;

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

fs::path requireFolder(const fs::path& folder, const std::string& given) {
  std::error_code unreadable;
  if (fs::is_directory(folder, unreadable)) return folder;
  throw UsageError(given + ": " + folder.string() + " is not a folder");
}

fs::path usualScratch() {
  const char* variable = std::getenv("TMPDIR");
  return variable && *variable ? variable : "/var/tmp";
}

/// Whoever writes a file there reports that the usual folder does not exist; most runs write none.
fs::path scratchOf(const Arguments& arguments) {
  const auto given = arguments.find<std::string>(kScratch);
  return given ? requireFolder(*given, "--" + std::string(kScratch)) : usualScratch();
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

fs::path scratchFolder() { return requireFolder(usualScratch(), "the variable TMPDIR"); }

fs::path scratchFolderOf(const Arguments& arguments) {
  return arguments.has(kScratch) ? scratchOf(arguments) : scratchFolder();
}

HostMemory hostMemoryOf(const Arguments& arguments) {
  const std::uint64_t maxBytes = maxBytesOf(arguments), share = maxBytes / kVolumesInMemory;
  return {maxBytes, VoxelMemory({scratchOf(arguments), share, share})};
}

}  // namespace esvr::cli
