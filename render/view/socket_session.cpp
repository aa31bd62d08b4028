#include "render/view/socket_session.h"

#include <boost/asio/post.hpp>
#include <string_view>
#include <utility>

#include "render/view/failed_message.h"

namespace esvr::view {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using beast::error_code;

constexpr std::size_t kMostAnswers = 4;  // that wait while a further message is read

websocket::stream_base::timeout timeoutOf(const ServerLimits& limits) {
  websocket::stream_base::timeout timeout{};
  timeout.handshake_timeout = limits.requestTime;
  timeout.idle_timeout = limits.idleTime;
  timeout.keep_alive_pings = true;
  return timeout;
}

}  // namespace

SocketSession::SocketSession(beast::tcp_stream stream, const SocketContext& context,
                             std::shared_ptr<void> seat)
    : socket_(std::move(stream)),
      context_(context),
      seat_(std::move(seat)),
      timer_(socket_.get_executor()),
      rate_(context.limits.messagesPerSecond, context.limits.messageBurst) {
  beast::get_lowest_layer(socket_).expires_never();  // the socket has its own times
  socket_.set_option(timeoutOf(context.limits));
  socket_.read_message_max(context.limits.messageBytes);
  socket_.auto_fragment(false);  // a picture is one frame
}

void SocketSession::run(Request request) {
  request_ = std::move(request);
  socket_.async_accept(request_, [self = shared_from_this()](error_code error) {
    if (!error) self->read();
  });
}

void SocketSession::deliver(std::string bytes) {
  ++delivering_;
  post({std::move(bytes), true});
}

void SocketSession::post(Message message) {
  boost::asio::post(socket_.get_executor(),
                    [self = shared_from_this(), message = std::move(message)]() mutable {
                      self->enqueue(std::move(message));
                    });
}

void SocketSession::enqueue(Message message) {
  if (!socket_.is_open()) return;
  queue_.push_back(std::move(message));
  if (queue_.size() == 1) write();
}

void SocketSession::read() {
  socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
    if (error)
      self->close();
    else
      self->onRead();
  });
}

void SocketSession::onRead() {
  const auto data = buffer_.cdata();
  const std::string_view text(static_cast<const char*>(data.data()), data.size());
  if (!take(text)) ++wrongMessages_;
  buffer_.consume(buffer_.size());
  if (wrongMessages_ <= context_.limits.wrongMessages) return readLater();
  socket_.async_close(websocket::close_code::policy_error,
                      [self = shared_from_this()](error_code) { self->close(); });
}

/// \return false if the message was wrong
bool SocketSession::take(std::string_view message) {
  if (!socket_.got_binary()) return context_.desk.receive(shared_from_this(), message);
  answer(failedMessage("messages must be text, and this one is binary"));
  return false;
}

/// Reads the next message when the rate allows it and answers do not pile up.
void SocketSession::readLater() {
  timer_.expires_after(rate_.count(MessageRate::Clock::now()));
  timer_.async_wait([self = shared_from_this()](error_code error) {
    if (error) return;
    if (self->queue_.size() <= kMostAnswers)
      self->read();
    else
      self->readsWhenSent_ = true;
  });
}

void SocketSession::write() {
  socket_.binary(queue_.front().isBinary);
  socket_.async_write(boost::asio::buffer(queue_.front().bytes),
                      [self = shared_from_this()](error_code error, std::size_t) {
                        if (error)
                          self->close();
                        else
                          self->onWritten();
                      });
}

void SocketSession::onWritten() {
  if (queue_.front().isBinary) --delivering_, context_.studio.wake();
  queue_.pop_front();
  if (!queue_.empty()) write();
  if (readsWhenSent_ && queue_.size() <= kMostAnswers) readsWhenSent_ = false, read();
}

void SocketSession::close() {
  context_.studio.leave(*this);
  timer_.cancel();
  error_code ignored;
  beast::get_lowest_layer(socket_).socket().close(ignored);
}

}  // namespace esvr::view
