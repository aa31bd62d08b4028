#include "render/view/options.h"

#include "cli/command_line.h"
#include "cli/device_option.h"
#include "render/view/limits.h"

namespace esvr::view {
namespace {

using cli::po::bool_switch;
using cli::po::value;

constexpr int kMaxPort = 65535, kMostClients = 1000;

cli::ProgramText programText() {
  return {
      .name = kProgram,
      .purpose =
          "Shows .esvr files and VDB files in a browser: orbit, edit the transfer function over\n"
          "the histogram, compare with a reference. This program draws, and serves the page.",
      .usage = "  esvr-view FILE.esvr|FILE.vdb... [OPTION]...",
      .notes =
          "The program prints an address; open it in a browser. The address has a secret, which\n"
          "every request needs, and is valid until the program ends by Ctrl-C.\n"
          "\n"
          "It listens to this machine only. From another machine, forward the port:\n"
          "  ssh -L 8080:127.0.0.1:8080 HOST esvr-view FILE.esvr --port 8080\n"
          "The connection is not encrypted by itself; SSH does that. With --bind, anyone who can\n"
          "read the network can read the pictures and the secret.\n"
          "\n"
          "Clients can see the files of the command line, and no others.\n"
          "\n"
          "Exit codes: 0 ended by Ctrl-C, 1 failure, 2 wrong options, 3 input that is damaged or\n"
          "cannot be used, 5 no such device or not enough memory.",
      .examples =
          "  esvr-view smoke.esvr\n"
          "  esvr-view smoke.esvr smoke.vdb      the original, to compare\n"
          "  esvr-view smoke.esvr --open"};
}

cli::CommandLine commandLine() {
  cli::CommandLine line(programText());
  line.repeatedArgument("FILE");
  // clang-format off
  line.options().add_options()
    ("port", value<int>()->value_name("N")->default_value(0),
     "port to listen at; 0 is one that is free")
    ("bind", value<std::string>()->value_name("ADDRESS")->default_value(Options{}.bind),
     "address to listen at; others than the default are reached from other machines")
    ("open", bool_switch(), "open the page in the browser of this machine")
    ("clients", value<int>()->value_name("N")->default_value(int(ServerLimits{}.clients)),
     "largest number of pages at a time");
  // clang-format on
  cli::addDevice(line.options());
  cli::addHostMemory(line);
  return line;
}

}  // namespace

std::optional<Options> parseOptions(int argc, const char* const* argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const cli::Arguments& a = *arguments;
  const auto files = a.find<std::vector<std::string>>("FILE").value_or(std::vector<std::string>{});
  if (files.empty()) throw UsageError("FILE is missing");
  Options options;
  options.inputs.assign(files.begin(), files.end());
  options.bind = a.get<std::string>("bind");
  options.port = a.get<int>("port");
  cli::requireRange("port", options.port, 0, kMaxPort);
  options.open = a.get<bool>("open");
  options.clients = a.get<int>("clients");
  cli::requireRange("clients", options.clients, 1, kMostClients);
  options.device = cli::deviceOf(a);
  options.memory = cli::hostMemoryOf(a);
  options.threads = a.threads;
  options.verbosity = a.verbosity;
  return options;
}

}  // namespace esvr::view
