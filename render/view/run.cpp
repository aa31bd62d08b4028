#include "render/view/run.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <iostream>

#include "esvr/error.h"
#include "render/view/page.h"
#include "render/view/server.h"
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

ServerLimits limitsOf(const Options& options) {
  ServerLimits limits;
  limits.clients = std::size_t(options.clients);
  return limits;
}

/// Ends the studio before the connections to which it sends.
struct StopAtEnd {
  Studio& studio;
  ~StopAtEnd() { studio.stop(); }
};

void serve(const Options& options, Studio& studio, Desk& desk) {
  const ServerLimits limits = limitsOf(options);
  HttpContext context{siteOf(options), viewPage(), {desk, studio, limits}, Seats(limits.clients)};
  asio::io_context io(1);
  const StopAtEnd stop{studio};
  Server server(io, endpointOf(options), context);
  asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&](boost::system::error_code, int) { io.stop(); });
  server.run();
  std::cout << urlOf(server.endpoint(), context.site.token) << std::endl;
  io.run();
}

}  // namespace

void run(const Options& options) {
  const Device device = selectDevice(options.device);
  const Collection collection(options.inputs, options.memory);
  Studio studio(collection, {device, options.limits, {}, false, options.memory});
  Desk desk(collection, studio, deviceName(device));
  serve(options, studio, desk);
}

}  // namespace esvr::view
