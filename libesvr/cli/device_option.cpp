#include "cli/device_option.h"

namespace esvr::cli {
namespace {

constexpr const char* kDevice = "device";

}  // namespace

void addDevice(po::options_description& options, const std::string& purpose,
               const std::string& more) {
  const std::string help = purpose + "auto (a GPU if one is usable), cpu, cuda or cuda:N" + more;
  options.add_options()(kDevice, po::value<std::string>()->value_name("D")->default_value("auto"),
                        help.c_str());
}

std::string deviceOf(const Arguments& arguments) { return arguments.get<std::string>(kDevice); }

}  // namespace esvr::cli
