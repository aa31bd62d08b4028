#include "render/view/http_session.h"

#include <boost/beast/http/error.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <limits>
#include <utility>

namespace esvr::view {

namespace {

using boost::beast::error_code;

}  // namespace

HttpSession::HttpSession(boost::asio::ip::tcp::socket socket, HttpContext& context)
    : stream_(std::move(socket)), context_(context), buffer_(context.socket.limits.headBytes) {
  parser_.header_limit(std::uint32_t(context.socket.limits.headBytes));
  // No body is read, and judge() refuses requests with one.
  parser_.body_limit(std::numeric_limits<std::uint64_t>::max());
}

void HttpSession::run() {
  stream_.expires_after(context_.socket.limits.guestTime);
  http::async_read_header(
      stream_, buffer_, parser_,
      [self = shared_from_this()](error_code error, std::size_t) { self->onHead(error); });
}

void HttpSession::drop() {
  error_code ignored;
  stream_.socket().close(ignored);  // what waits for the connection ends with an error
}

void HttpSession::onHead(error_code error) {
  if (!error) return serve(parser_.get());
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    return send(statusResponse(http::status::request_header_fields_too_large));
  const bool isHttp =
      error.category() == http::make_error_code(http::error::end_of_stream).category();
  if (isHttp && error != http::error::end_of_stream && error != http::error::partial_message)
    send(statusResponse(http::status::bad_request));
}

void HttpSession::serve(const Request& request) {
  const Verdict verdict = judge(request, context_.site);
  if (verdict.target == Target::kNothing) return send(statusResponse(verdict.status));
  seat_ = context_.requests.take();
  if (!seat_) return send(statusResponse(http::status::service_unavailable));
  stream_.expires_after(context_.socket.limits.requestTime);
  if (verdict.target == Target::kSocket) return openSocket(request);
  const auto host = request[http::field::host];
  send(pageResponse(context_.page, {host.data(), host.size()}));
}

void HttpSession::openSocket(Request request) {
  auto seat = context_.clients.take();
  if (!seat) return send(statusResponse(http::status::service_unavailable));
  std::make_shared<SocketSession>(std::move(stream_), context_.socket, std::move(seat))
      ->run(std::move(request));
}

void HttpSession::send(Response response) {
  response_ = std::move(response);
  http::async_write(stream_, response_, [self = shared_from_this()](error_code, std::size_t) {
    error_code ignored;
    self->stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
    self->drain();
  });
}

/// Reads until the client closes or its time is over. If a connection is closed before all was read,
/// the client may lose the answer.
void HttpSession::drain() {
  stream_.async_read_some(boost::asio::buffer(rest_),
                          [self = shared_from_this()](error_code error, std::size_t) {
                            if (!error) self->drain();
                          });
}

}  // namespace esvr::view
