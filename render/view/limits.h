#pragma once
/// What clients may take.

#include <chrono>
#include <cstddef>

namespace esvr::view {

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
  /// A guest that has not shown the token within this time is dropped. Clients send their request with
  /// the connection; the time is for networks that are slow.
  std::chrono::milliseconds guestTime{1'000};
  std::chrono::milliseconds requestTime{10'000};  ///< from the token to the end of the answer
  std::chrono::milliseconds idleTime{60'000};     ///< of a socket; one that is alive answers pings
};

}  // namespace esvr::view
