#include "cli/version_text.h"

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/vdb_io.h"

namespace esvr::cli {

std::string programVersion() { return ESVR_VERSION; }

std::string versionText(const std::string& program) {
  return program + " " + programVersion() + "\n" + ".esvr format " +
         std::to_string(kFormatVersion) + "\n" + vdbVersions() + "\n" + cudaVersions() + "\n";
}

}  // namespace esvr::cli
