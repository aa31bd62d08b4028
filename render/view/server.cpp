#include "render/view/server.h"

#include <memory>
#include <string>
#include <utility>

#include "esvr/error.h"

namespace esvr::view {
namespace {

using boost::asio::ip::tcp;

tcp::acceptor listeningAt(boost::asio::io_context& io, const tcp::endpoint& at) try {
  return tcp::acceptor(io, at);
} catch (const boost::system::system_error& error) {
  throw RuntimeFailure("cannot listen at " + at.address().to_string() + ", port " +
                       std::to_string(at.port()) + ": " + error.code().message());
}

}  // namespace

Server::Server(boost::asio::io_context& io, const tcp::endpoint& at, HttpContext& context)
    : acceptor_(listeningAt(io, at)),
      pause_(io),
      endpoint_(acceptor_.local_endpoint()),
      context_(context),
      guests_(context.socket.limits.guests) {}

void Server::run() {
  acceptor_.async_accept([this](boost::system::error_code error, tcp::socket socket) {
    if (error) return runLater();
    boost::system::error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    const auto session = std::make_shared<HttpSession>(std::move(socket), context_);
    guests_.admit(session);
    session->run();
    run();
  });
}

/// Waits a moment, because the error, such as too many open files, would occur again at once.
void Server::runLater() {
  constexpr std::chrono::milliseconds kPause{100};
  pause_.expires_after(kPause);
  pause_.async_wait([this](boost::system::error_code error) {
    if (!error) run();
  });
}

}  // namespace esvr::view
