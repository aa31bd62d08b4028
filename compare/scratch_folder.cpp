#include "compare/scratch_folder.h"

#include <cstdlib>
#include <string>
#include <system_error>

#include "cli/host_memory.h"
#include "esvr/error.h"

namespace esvr::compare {

ScratchFolder::ScratchFolder() {
  std::string pattern = cli::scratchFolder() / "esvr-compare-XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr)
    throw RuntimeFailure("cannot make a temporary folder with the pattern " + pattern);
  path_ = pattern;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace esvr::compare
