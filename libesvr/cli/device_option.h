#pragma once
/// The option --device.

#include <string>

#include "cli/command_line.h"

namespace esvr::cli {

/// Adds the option. Its help text begins with `purpose` and ends with `more`.
void addDevice(po::options_description& options, const std::string& purpose = {},
               const std::string& more = {});

/// The value of the option, as selectDevice() or selectDevices() take it.
[[nodiscard]] std::string deviceOf(const Arguments& arguments);

}  // namespace esvr::cli
