// esvr-view shows .esvr files and VDB files in a browser.

#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

#include <array>
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/signal_set.hpp>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "esvr/error.h"
#include "esvr/render.h"
#include "programs/command_line.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "programs/video_file.h"
#include "render/view/server.h"

extern char** environ;

namespace esvr::view {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using asio::ip::tcp;
using cli::po::bool_switch;
using cli::po::value;

// Options.

struct Options {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path exported;  ///< page to write instead of serving; empty: none
  bool overwrite = false;
  std::string bind = "127.0.0.1";  ///< address to listen at
  int port = 0;                    ///< 0: one that is free
  bool open = false;               ///< open the page in a browser
  int clients = 0;                 ///< clients at a time
  std::string device = "auto";
  RendererLimits limits;
  cli::HostMemory memory;  ///< memory that input may take
  int threads = 0;         ///< 0: all
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
};

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

/// Parses the command line. \return nothing if --help or --version was printed
/// \throws UsageError  the options are wrong
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

// The page in a browser.

/// A file that leads a browser to an address, and is removed with this object. Only its owner can
/// read it, whereas every user of the machine could read the address in the browser's command line.
class OpenedPage {
 public:
  /// Opens the file by the program xdg-open.
  /// \throws UsageError      there is no such program
  /// \throws RuntimeFailure  the file cannot be written, or the program not be started
  explicit OpenedPage(const std::string& url);
  ~OpenedPage();
  OpenedPage(const OpenedPage&) = delete;
  OpenedPage& operator=(const OpenedPage&) = delete;

 private:
  std::filesystem::path file_;
};

[[noreturn]] void fail(const std::string& what, int error) {
  throw RuntimeFailure(what + ": " + std::generic_category().message(error));
}

/// Writes a file that only its owner can read. \return its path
fs::path writePrivate(const std::string& text) {
  constexpr std::string_view kSuffix = ".html";
  std::string name = (cli::scratchFolder() / "esvr-view-XXXXXX").string() + std::string(kSuffix);
  report::Descriptor file(::mkstemps(name.data(), int(kSuffix.size())));
  if (file.get() < 0) fail(name, errno);
  if (::write(file.get(), text.data(), text.size()) != ssize_t(text.size())) fail(name, errno);
  return name;
}

/// Starts a program in a session of its own, so that Ctrl-C and the end of this program do not
/// reach the browser.
void start(const fs::path& program, std::string argument) {
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, descriptor, "/dev/null", O_RDWR, 0);
  std::string name = program.string();
  std::array<char*, 3> words{name.data(), argument.data(), nullptr};
  pid_t id = 0;
  const int error = posix_spawn(&id, name.c_str(), &actions, &attributes, words.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) fail(name, error);
}

OpenedPage::OpenedPage(const std::string& url) {
  const auto opener = report::findProgram("xdg-open");
  if (!opener) throw UsageError("--open needs the program xdg-open");
  file_ = writePrivate(
      "<!doctype html>\n<meta charset=\"utf-8\">\n<title>esvr-view</title>\n"
      "<meta name=\"referrer\" content=\"no-referrer\">\n"
      "<meta http-equiv=\"refresh\" content=\"0; url=" +
      url + "\">\n<a href=\"" + url + "\">esvr-view</a>\n");
  start(*opener, file_.string());
}

OpenedPage::~OpenedPage() {
  std::error_code ignored;
  fs::remove(file_, ignored);
}

// The program.

tcp::endpoint endpointOf(const Options& options) {
  boost::system::error_code error;
  const auto address = asio::ip::make_address(options.bind, error);
  if (error) throw UsageError("--bind must be an address, not '" + options.bind + "'");
  return {address, static_cast<unsigned short>(options.port)};
}

Site siteOf(const Options& options) {
  Site site{randomToken(), {}};
  if (options.bind != Options{}.bind) site.hostNames.push_back(asio::ip::host_name());
  return site;
}

/// The address of the page. A server that listens everywhere is reached by the machine's name.
std::string urlOf(const tcp::endpoint& at, const std::string& token) {
  std::string host = at.address().to_string();
  if (at.address().is_unspecified())
    host = asio::ip::host_name();
  else if (at.address().is_v6())
    host = "[" + host + "]";
  return "http://" + host + ":" + std::to_string(at.port()) + "/" + token + "/";
}

Service::Settings settingsOf(const Options& options) {
  Service::Settings settings{endpointOf(options), siteOf(options), {}, {}};
  settings.limits.clients = std::size_t(options.clients);
  settings.drawing = {selectDevice(options.device), options.limits, {}, false, options.memory};
  return settings;
}

void serve(const Options& options) {
  const cli::Log log(kProgram, options.verbosity);
  const Service::Settings settings = settingsOf(options);
  const Collection collection(options.inputs, options.memory);
  Service service(collection, settings);
  asio::signal_set signals(service.io(), SIGINT, SIGTERM);
  signals.async_wait([&](boost::system::error_code, int) { service.stop(); });
  const std::string url = urlOf(service.endpoint(), settings.site.token);
  std::cout << url << std::endl;
  log.info("open this address in a browser; Ctrl-C ends the program");
  std::optional<OpenedPage> opened;
  if (options.open) opened.emplace(url);
  service.run();
  // Nothing that is drawn, read or encoded has to be completed: the program has no files to write.
  constexpr std::chrono::milliseconds kPatience{500};
  if (service.endsWithin(kPatience)) return;
  std::cout.flush();
  opened.reset();  // removes its file
  std::_Exit(0);
}

/// Writes a page if one is to be exported; otherwise serves the page until SIGINT or SIGTERM.
/// \throws Error
void run(const Options& options) {
  if (options.exported.empty()) return serve(options);
  exportPage({options.inputs.front(), options.exported, options.overwrite, options.memory});
  const auto bytes = std::to_string(std::filesystem::file_size(options.exported));
  cli::Log(kProgram, options.verbosity)
      .info(options.exported.string() + ": a page of " + bytes + " bytes");
}

}  // namespace
}  // namespace esvr::view

int main(int argc, char** argv) {
  using namespace esvr;
  return cli::runMain(view::kProgram, [&] {
    const auto options = view::parseOptions(argc, argv);
    if (!options) return 0;
    const cli::ThreadLimit threads(options->threads);
    view::run(*options);
    return 0;
  });
}
