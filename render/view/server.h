#pragma once
/// Accepts connections.

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "render/view/http_session.h"

namespace esvr::view {

/// Its functions, and those of its connections, are called by the thread that runs the context.
class Server {
 public:
  /// Listens.
  /// \throws RuntimeFailure  the address cannot be used
  Server(boost::asio::io_context& io, const boost::asio::ip::tcp::endpoint& at,
         HttpContext& context);

  [[nodiscard]] boost::asio::ip::tcp::endpoint endpoint() const { return endpoint_; }
  /// Begins to accept connections.
  void run();

 private:
  void runLater();

  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer pause_;
  boost::asio::ip::tcp::endpoint endpoint_;
  HttpContext& context_;
  Guests<HttpSession> guests_;
};

}  // namespace esvr::view
