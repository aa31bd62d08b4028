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
          "Shows .esvr files and VDB files in a browser: orbit, edit the transfer function over "
          "the histogram, compare with a reference. This program draws, and serves the page.",
      .usage =
          "  esvr-view FILE.esvr|FILE.vdb... [OPTION]...\n"
          "  esvr-view --export PAGE.html FILE.esvr [--force]",
      .notes =
          "The program prints an address; open it in a browser. The address has a secret, which "
          "every request needs, and is valid until the program ends by Ctrl-C.\n"
          "\n"
          "It listens to this machine only. From another machine, forward the port:\n"
          "  ssh -L 8080:127.0.0.1:8080 HOST esvr-view FILE.esvr --port 8080\n"
          "The connection is not encrypted by itself; SSH does that. With --bind, anyone who can "
          "read the network can read the pictures and the secret.\n"
          "\n"
          "Clients can see the files of the command line, and no others.\n"
          "\n"
          "--export writes a page that contains the file and draws it in the browser. It needs no "
          "server and no network, and can be sent by mail or opened from a disk.\n"
          "\n"
          "Exit codes: 0 ended by Ctrl-C or page written, 1 failure, 2 wrong options, 3 input that "
          "is damaged or cannot be used, 5 no such device or not enough memory.",
      .examples =
          "  esvr-view smoke.esvr\n"
          "  esvr-view smoke.esvr smoke.vdb      # the original, to compare\n"
          "  esvr-view smoke.esvr --open\n"
          "  esvr-view --export smoke.html smoke.esvr"};
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
     "largest number of pages at a time")
    ("export", value<std::string>()->value_name("PAGE.html"),
     "write a page that contains FILE.esvr and needs no server, see the notes")
    ("force,f", bool_switch(), "replace PAGE.html if it exists");
  // clang-format on
  cli::addDevice(line.options());
  cli::addHostMemory(line);
  return line;
}

void readExport(const cli::Arguments& a, Options& options) {
  const auto page = a.find<std::string>("export");
  if (!page) return;
  if (options.inputs.size() != 1) throw UsageError("--export takes one FILE.esvr");
  if (options.open) throw UsageError("--open cannot be given with --export");
  options.exported = *page;
  options.overwrite = a.get<bool>("force");
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
  readExport(a, options);
  options.device = cli::deviceOf(a);
  options.memory = cli::hostMemoryOf(a);
  options.threads = a.threads;
  options.verbosity = a.verbosity;
  return options;
}

}  // namespace esvr::view
