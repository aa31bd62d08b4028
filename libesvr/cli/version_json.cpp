#include "cli/version_json.h"

#include <nlohmann/json.hpp>

#include "cli/version_text.h"
#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/vdb_io.h"

namespace esvr::cli {

nlohmann::ordered_json versionJson() {
  return {{"esvr", programVersion()},
          {"format", kFormatVersion},
          {"vdb", vdbVersions()},
          {"cuda", cudaVersions()}};
}

}  // namespace esvr::cli
