#include "cli/memory_limit.h"

#include "cli/byte_size.h"
#include "cli/memory.h"

namespace esvr::cli {
namespace {

constexpr const char* kOption = "max-memory";
constexpr double kShare = 0.75;  // the rest is left to other programs

}  // namespace

void addMaxMemory(CommandLine& line) {
  line.options().add_options()(kOption, po::value<std::string>()->value_name("SIZE"),
                               "refuse input that needs more memory than this, for example 8GB, "
                               "with exit code 5; the need is estimated before any work begins "
                               "(default: 3/4 of the memory that is available)");
}

std::uint64_t maxMemoryOf(const Arguments& arguments) {
  if (const auto size = arguments.find<std::string>(kOption)) return parseByteSize(kOption, *size);
  return std::uint64_t(kShare * double(availableMemory()));
}

}  // namespace esvr::cli
