#pragma once
/// What clients may take.

#include <chrono>
#include <cstddef>

namespace esvr::view {

struct ServerLimits {
  std::size_t clients = 16;      ///< sockets at a time
  std::size_t connections = 64;  ///< connections at a time that are no sockets
  std::size_t headBytes = 8192;  ///< of a request
  std::size_t messageBytes = std::size_t{64} << 10;
  int wrongMessages = 20;  ///< of a socket before it is closed
  /// Messages of a socket in a second, and how many may come at once. Further ones are read later.
  double messagesPerSecond = 200.0, messageBurst = 200.0;
  std::chrono::milliseconds requestTime{10'000};  ///< from the connection to the answer
  std::chrono::milliseconds idleTime{60'000};     ///< of a socket; one that is alive answers pings
};

}  // namespace esvr::view
