#pragma once
/// The viewer's server as a whole.

#include <boost/asio/io_context.hpp>
#include <chrono>

#include "render/view/desk.h"
#include "render/view/server.h"
#include "render/view/studio.h"

namespace esvr::view {

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

  [[nodiscard]] boost::asio::ip::tcp::endpoint endpoint() const { return server_.endpoint(); }
  [[nodiscard]] boost::asio::io_context& io() { return io_; }

  /// Serves until stop(), which any thread may call.
  void run() { io_.run(); }
  void stop() { io_.stop(); }
  /// Stops, and cancels what is drawn. \return false if that goes on for longer than a time, for example
  /// because a large file is being read
  [[nodiscard]] bool endsWithin(std::chrono::milliseconds time);

 private:
  boost::asio::io_context io_;
  Studio studio_;
  Desk desk_;
  HttpContext context_;
  Server server_;
};

}  // namespace esvr::view
