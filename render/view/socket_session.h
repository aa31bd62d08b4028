#pragma once
/// The connection to a client that has opened a socket.

#include <atomic>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "render/view/desk.h"
#include "render/view/limits.h"
#include "render/view/message_rate.h"
#include "render/view/outlet.h"
#include "render/view/request_rules.h"

namespace esvr::view {

/// What sockets work with. It outlives them.
struct SocketContext {
  Desk& desk;
  Studio& studio;
  ServerLimits limits;
};

/// All its work is on the thread of its stream, except for Outlet's functions. A client that does not
/// read holds few answers and one picture, because its next message is read after its answers were
/// sent, and because the studio passes over it.
class SocketSession : public Outlet, public std::enable_shared_from_this<SocketSession> {
 public:
  SocketSession(boost::beast::tcp_stream stream, const SocketContext& context,
                std::shared_ptr<void> seat);

  /// Accepts the request, and serves the client until the connection ends.
  void run(Request request);

  void answer(std::string text) override { post({std::move(text), false}); }
  void deliver(std::string bytes) override;
  [[nodiscard]] bool busy() const override { return delivering_ > 0; }

 private:
  struct Message {
    std::string bytes;
    bool isBinary = false;
  };
  void post(Message message);
  void enqueue(Message message);
  void read();
  void onRead();
  [[nodiscard]] bool take(std::string_view message);
  void readLater();
  void write();
  void onWritten();
  void close();

  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  const SocketContext& context_;
  const std::shared_ptr<void> seat_;
  Request request_;
  boost::beast::flat_buffer buffer_;
  boost::asio::steady_timer timer_;
  MessageRate rate_;
  int wrongMessages_ = 0;
  std::deque<Message> queue_;   ///< the first one is being written
  bool readsWhenSent_ = false;  ///< the next message is read when the queue is short again
  std::atomic<int> delivering_ = 0;
};

}  // namespace esvr::view
