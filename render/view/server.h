#pragma once
/// The pages: the viewer that the server gives to browsers, and pages that need no server, because
/// they contain the file and draw it themselves.
/// The viewer's server: what a request gets, by rules, without a socket and with the secret in the server's address; and the
/// server as a whole, and what its clients may take.

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/status.hpp>
#include <boost/beast/http/string_body.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "programs/resources.h"
#include "render/view/desk.h"
#include "render/view/studio.h"

namespace esvr::view {

/// The viewer as one HTML file.
[[nodiscard]] std::string_view viewPage();

/// The viewer that draws by itself, without a file in it.
[[nodiscard]] std::string_view exportPageBundle();

/// The largest file in a page, in bytes. Base64 makes it a third larger, and browsers have limits
/// on the length of a text.
inline constexpr std::uintmax_t kMostExportedBytes = std::uintmax_t{256} << 20;

/// The page for exported files with a file in it.
/// \param page   as exportPageBundle()
/// \param name   of the file, which the page shows
/// \param bytes  of the file
/// \throws std::logic_error  the page has no place for a file
[[nodiscard]] std::string exportedPage(std::string_view page, const std::string& name,
                                       std::string_view bytes);

/// What is to be exported.
struct Export {
  std::filesystem::path input, output;
  bool overwrite = false;
  cli::HostMemory memory;  ///< memory that reading the input may take
};

/// Writes the page of a file.
/// \throws UsageError      the input is no .esvr file of one frame, or is too large for a page; the
///                         output is no .html file
/// \throws BadInput, MemoryExceeded  as for showFile
/// \throws RuntimeFailure  as for cli::writeBytes
void exportPage(const Export& what);

// ---- The rules of requests

namespace http = boost::beast::http;
using Request = http::request<http::empty_body>;

/// What the server accepts.
struct Site {
  std::string token;
  /// Names that a Host header may have besides localhost and addresses. An address cannot be the
  /// name of another site that resolves to this machine (DNS rebinding).
  std::vector<std::string> hostNames;
};

enum class Target { kPage, kSocket, kNothing };

struct Verdict {
  Target target = Target::kNothing;
  http::status status = http::status::not_found;  ///< of the answer if there is no target
};

/// Decides what a request gets.
[[nodiscard]] Verdict judge(const Request& request, const Site& site);

using Response = http::response<http::string_body>;

/// The page, with a policy that lets only its own scripts run and lets it speak to this server
/// only.
/// \param host  the Host header of the request, which judge() has accepted
/// \param page  its scripts and styles have kNoncePlace as their nonce
[[nodiscard]] Response pageResponse(std::string_view page, std::string_view host);
/// The text that is replaced by a random nonce.
inline constexpr std::string_view kNoncePlace = "ESVR-NONCE";

/// An answer with nothing but a status.
[[nodiscard]] Response statusResponse(http::status status);

/// 128 random bits of the system as 32 hexadecimal digits.
[[nodiscard]] std::string randomToken();

/// Compares in a time that does not depend on where the texts differ, so that the time of an answer
/// tells nothing about the token.
[[nodiscard]] bool sameSecret(std::string_view a, std::string_view b);

// ---- The server

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
