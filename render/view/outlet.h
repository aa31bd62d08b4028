#pragma once
/// The way to a client.

#include <string>

namespace esvr::view {

/// Sends messages to one client. Its functions may be called from any thread.
class Outlet {
 public:
  Outlet() = default;
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;
  virtual ~Outlet() = default;

  /// Sends JSON text.
  virtual void answer(std::string text) = 0;
  /// Sends a picture (binary_message.h).
  virtual void deliver(std::string bytes) = 0;
  /// True until all pictures are sent. A client that is busy gets no picture.
  [[nodiscard]] virtual bool busy() const = 0;
};

}  // namespace esvr::view
