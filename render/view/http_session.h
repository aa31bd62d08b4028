#pragma once
/// A connection before it opens a socket.

#include <array>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/parser.hpp>
#include <memory>
#include <string_view>

#include "render/view/request_rules.h"
#include "render/view/responses.h"
#include "render/view/seats.h"
#include "render/view/socket_session.h"

namespace esvr::view {

/// What connections work with. It outlives them.
struct HttpContext {
  Site site;
  std::string_view page;
  SocketContext socket;
  Seats clients;
  Seats requests;
};

/// Reads one request, and answers it or hands the connection to a SocketSession. It is a guest until its
/// request has the token.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(boost::asio::ip::tcp::socket socket, HttpContext& context);
  void run();

  [[nodiscard]] bool isGuest() const { return !seat_; }
  /// Closes the connection.
  void drop();

 private:
  void onHead(boost::beast::error_code error);
  void serve(const Request& request);
  void openSocket(Request request);
  void send(Response response);
  void drain();

  boost::beast::tcp_stream stream_;
  HttpContext& context_;
  std::shared_ptr<void> seat_;  ///< null for a guest
  boost::beast::flat_buffer buffer_;
  http::request_parser<http::empty_body> parser_;
  Response response_;
  std::array<char, 4096> rest_{};  ///< bytes that nobody reads
};

}  // namespace esvr::view
