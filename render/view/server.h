#pragma once
/// The viewer's server as a whole, and what its clients may take.

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>

#include "render/view/desk.h"
#include "render/view/request_rules.h"
#include "render/view/studio.h"

namespace esvr::view {

/// What clients may take.
struct ServerLimits {
  std::size_t clients = 16;  ///< sockets at a time
  /// Guests at a time: connections that have not shown the token. When there is a further one, the
  /// guest that came first is dropped.
  std::size_t guests = 64;
  std::size_t requests = 64;     ///< connections at a time that have shown it and are no sockets
  std::size_t headBytes = 8192;  ///< of a request
  std::size_t messageBytes = std::size_t{64} << 10;
  int wrongMessages = 20;  ///< of a socket before it is closed
  /// Messages of a socket in a second, and how many may come at once. Further ones are read later.
  double messagesPerSecond = 200.0, messageBurst = 200.0;
  /// A guest that has not shown the token within this time is dropped. Clients send their request
  /// with the connection; the time is for networks that are slow.
  std::chrono::milliseconds guestTime{1'000};
  std::chrono::milliseconds requestTime{10'000};  ///< from the token to the end of the answer
  std::chrono::milliseconds idleTime{60'000};     ///< of a socket; one that is alive answers pings
};

/// Limits how often something happens by a bucket of tokens: each event takes one, and they come
/// back at a constant rate.
class MessageRate {
 public:
  using Clock = std::chrono::steady_clock;

  MessageRate(double perSecond, double burst)
      : perSecond_(perSecond), burst_(burst), left_(burst) {}

  /// Counts an event. \return how long the next one has to wait
  [[nodiscard]] Clock::duration count(Clock::time_point now) {
    const std::chrono::duration<double> passed = now - last_.value_or(now);
    last_ = now;
    left_ = std::min(burst_, left_ + passed.count() * perSecond_) - 1.0;
    const std::chrono::duration<double> wait(std::max(0.0, -left_ / perSecond_));
    return std::chrono::duration_cast<Clock::duration>(wait);
  }

 private:
  double perSecond_, burst_, left_;
  std::optional<Clock::time_point> last_;
};

/// Serves a collection from the moment it is made; connections are served while run() runs.
class Service {
 public:
  struct Settings {
    boost::asio::ip::tcp::endpoint at;  ///< port 0: one that is free
    Site site;
    ServerLimits limits;
    render::DrawSettings drawing;
  };
  /// \param collection  must outlive the service
  /// \throws RuntimeFailure  the address cannot be used
  Service(const Collection& collection, const Settings& settings);
  /// Cancels what is drawn, and closes all connections.
  ~Service();
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  [[nodiscard]] boost::asio::ip::tcp::endpoint endpoint() const;
  [[nodiscard]] boost::asio::io_context& io() { return io_; }

  /// Serves until stop(), which any thread may call.
  void run() { io_.run(); }
  void stop() { io_.stop(); }
  /// Stops, and cancels what is drawn. \return false if that goes on for longer than a time, for
  /// example because a large file is being read
  [[nodiscard]] bool endsWithin(std::chrono::milliseconds time);

 private:
  boost::asio::io_context io_;
  Studio studio_;
  Desk desk_;
  struct Connections;
  std::unique_ptr<Connections> connections_;
};

}  // namespace esvr::view
