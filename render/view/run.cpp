#include "render/view/run.h"

#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <optional>

#include "cli/log.h"
#include "esvr/error.h"
#include "render/view/exported_page.h"
#include "render/view/opened_page.h"
#include "render/view/service.h"
#include "render/view/token.h"

namespace esvr::view {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

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

}  // namespace

void run(const Options& options) {
  if (options.exported.empty()) return serve(options);
  exportPage({options.inputs.front(), options.exported, options.overwrite, options.memory});
  const auto bytes = std::to_string(std::filesystem::file_size(options.exported));
  cli::Log(kProgram, options.verbosity)
      .info(options.exported.string() + ": a page of " + bytes + " bytes");
}

}  // namespace esvr::view
