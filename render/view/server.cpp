// Connections, from the moment that they are accepted: each reads one request as an HttpSession,
// and either gets an answer or becomes a SocketSession, over which messages come and pictures go.

#include "render/view/server.h"

#include <sys/random.h>
#include <tbb/global_control.h>

#include <array>
#include <atomic>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <cerrno>
#include <cstring>
#include <deque>
#include <fstream>
#include <iterator>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>

#include "esvr/error.h"
#include "programs/files.h"
#include "programs/page_figures.h"
#include "programs/sequence.h"
#include "render/view/collection.h"

namespace esvr::view {
namespace {

namespace fs = std::filesystem;

/// The element that holds the file; it is empty in the bundle.
constexpr std::string_view kPlace =
    R"(<script id="esvr-file" type="application/octet-stream;base64" data-name=""></script>)";
constexpr std::string_view kNameEnd = R"("></script>)", kElementEnd = "</script>";

std::string bytesIn(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file) throw BadInput(path.string() + ": cannot be read");
  return bytes;
}

void checkInput(const Export& what) {
  const std::string name = what.input.string();
  if (what.input.extension() != ".esvr")
    throw UsageError(name + ": a page contains an .esvr file; make one by vdb2esvr");
  if (cli::framesInFile(what.input))
    throw UsageError(name + " holds a sequence, and a page shows one frame");
  (void)showFile(what.input, what.memory);
  if (fs::file_size(what.input) > kMostExportedBytes)
    throw UsageError(name + " has more than " + std::to_string(kMostExportedBytes >> 20) +
                     " MiB, which is too large for a page");
}

}  // namespace

std::string exportedPage(std::string_view page, const std::string& name, std::string_view bytes) {
  const std::size_t place = page.find(kPlace);
  if (place == std::string_view::npos) throw std::logic_error("the page has no place for a file");
  const std::size_t nameEnd = place + kPlace.size() - kNameEnd.size();
  const std::size_t textEnd = place + kPlace.size() - kElementEnd.size();
  std::string text(page.substr(0, nameEnd));
  text += report::escaped(name);
  text += page.substr(nameEnd, textEnd - nameEnd);
  text += report::base64(bytes);
  return text.append(page.substr(textEnd));
}

void exportPage(const Export& what) {
  cli::requireSeparate({what.input}, {what.output});
  cli::checkOutput(what.output, {".html"}, what.overwrite);
  checkInput(what);
  const std::string page =
      exportedPage(exportPageBundle(), what.input.filename().string(), bytesIn(what.input));
  cli::writeBytes(what.output, std::as_bytes(std::span(page)), what.overwrite);
}

// ---- The rules of requests

// The secret.

std::string randomToken() {
  constexpr const char* kDigits = "0123456789abcdef";
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != ssize_t(bytes.size()))
    throw RuntimeFailure(std::string("no random numbers: ") + std::strerror(errno));
  std::string token;
  for (const unsigned char byte : bytes) {
    token += kDigits[byte >> 4];
    token += kDigits[byte & 15u];
  }
  return token;
}

bool sameSecret(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;  // the length is no secret
  unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference = static_cast<unsigned char>(difference | (a[i] ^ b[i]));
  return difference == 0;
}

// Rules.

namespace {

std::string_view view(boost::beast::string_view text) { return {text.data(), text.size()}; }

/// The host of "host", "host:port", "[address]" or "[address]:port"; empty if the text is none of
/// these.
std::string hostOf(std::string_view text) {
  if (!text.starts_with('[')) return std::string(text.substr(0, text.find(':')));
  const auto end = text.find(']');
  return end == std::string_view::npos ? "" : std::string(text.substr(1, end - 1));
}

bool isAddress(const std::string& host) {
  boost::system::error_code error;
  (void)boost::asio::ip::make_address(host, error);
  return !error;
}

bool isOwnHost(std::string_view text, const Site& site) {
  const std::string host = hostOf(text);
  return host == "localhost" || isAddress(host) ||
         std::find(site.hostNames.begin(), site.hostNames.end(), host) != site.hostNames.end();
}

/// The only value of a header; nothing if it is missing or occurs several times.
std::optional<std::string_view> single(const Request& request, http::field field) {
  if (request.count(field) != 1) return std::nullopt;
  return view(request[field]);
}

/// Browsers send the origin of the page that opens a socket. Other programs send none; they know
/// the token.
bool isOwnOrigin(const Request& request, std::string_view host) {
  if (request.count(http::field::origin) == 0) return true;
  const auto origin = single(request, http::field::origin);
  return origin && *origin == "http://" + std::string(host);
}

Target targetOf(std::string_view path, const Site& site) {
  if (!path.starts_with('/')) return Target::kNothing;
  const auto end = path.find('/', 1);
  if (end == std::string_view::npos || !sameSecret(path.substr(1, end - 1), site.token))
    return Target::kNothing;
  if (path.substr(end) == "/") return Target::kPage;
  return path.substr(end) == "/socket" ? Target::kSocket : Target::kNothing;
}

bool hasBody(const Request& request) {
  const auto length = request.find(http::field::content_length);
  return request.chunked() || (length != request.end() && length->value() != "0");
}

}  // namespace

Verdict judge(const Request& request, const Site& site) {
  const auto refused = [](http::status status) { return Verdict{Target::kNothing, status}; };
  const auto host = single(request, http::field::host);
  if (!host || !isOwnHost(*host, site) || !isOwnOrigin(request, *host))
    return refused(http::status::forbidden);
  const Target target = targetOf(view(request.target()), site);
  if (target == Target::kNothing) return refused(http::status::not_found);
  if (request.method() != http::verb::get) return refused(http::status::method_not_allowed);
  if (hasBody(request)) return refused(http::status::payload_too_large);
  if (target == Target::kSocket && !boost::beast::websocket::is_upgrade(request))
    return refused(http::status::upgrade_required);
  return {target, http::status::ok};
}

// Answers.

namespace {

constexpr unsigned kHttp11 = 11;

Response responseOf(http::status status, const char* type, std::string body) {
  Response response(status, kHttp11, std::move(body));
  response.set(http::field::content_type, type);
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("X-Frame-Options", "DENY");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.keep_alive(false);
  response.prepare_payload();
  return response;
}

std::string withNonce(std::string_view page, const std::string& nonce) {
  std::string text(page);
  for (std::size_t at = 0; (at = text.find(kNoncePlace, at)) != std::string::npos;)
    text.replace(at, kNoncePlace.size(), nonce);
  return text;
}

}  // namespace

Response pageResponse(std::string_view page, std::string_view host) {
  const std::string nonce = randomToken(), own(host);
  Response response =
      responseOf(http::status::ok, "text/html; charset=utf-8", withNonce(page, nonce));
  // Not every browser counts ws: as 'self'.
  response.set("Content-Security-Policy",
               "default-src 'none'; script-src 'nonce-" + nonce + "'; style-src 'nonce-" + nonce +
                   "'; img-src blob: data:; connect-src 'self' ws://" + own +
                   "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
  return response;
}

Response statusResponse(http::status status) {
  const auto reason = http::obsolete_reason(status);
  Response response = responseOf(status, "text/plain; charset=utf-8",
                                 std::string(reason.data(), reason.size()) + "\n");
  if (status == http::status::method_not_allowed) response.set(http::field::allow, "GET");
  return response;
}

// ---- The server

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using beast::error_code;

// What exists at a time.

/// A number of seats. They are taken and left on one thread.
class Seats {
 public:
  explicit Seats(std::size_t count) : free_(std::make_shared<std::size_t>(count)) {}

  /// A seat that is left when the last copy of the result is destroyed; null if there is none.
  [[nodiscard]] std::shared_ptr<void> take() {
    if (*free_ == 0) return nullptr;
    --*free_;
    return {free_.get(), [free = free_](void*) { ++*free; }};
  }

 private:
  std::shared_ptr<std::size_t> free_;
};

/// The guests that are there at a time. A further one takes the place of the one that came first,
/// so that guests who only wait keep nobody out.
/// \tparam Guest  has isGuest(), and drop(), which ends it
template <class Guest>
class Guests {
 public:
  explicit Guests(std::size_t most) : most_(most) {}

  void admit(const std::shared_ptr<Guest>& guest) {
    std::erase_if(guests_, [](const std::weak_ptr<Guest>& g) {
      const auto there = g.lock();
      return !there || !there->isGuest();
    });
    if (guests_.size() >= most_ && !guests_.empty()) {
      if (const auto first = guests_.front().lock()) first->drop();
      guests_.pop_front();
    }
    guests_.push_back(guest);
  }

 private:
  std::size_t most_;
  std::deque<std::weak_ptr<Guest>> guests_;  ///< the one that came first is the first
};

// Sockets.

/// What sockets work with. It outlives them.
struct SocketContext {
  Desk& desk;
  Studio& studio;
  ServerLimits limits;
};

/// The connection to a client that has opened a socket. All its work is on the thread of its stream, except for Outlet's functions. A client that does
/// not read holds few answers and one picture, because its next message is read after its answers
/// were sent, and because the studio passes over it.
class SocketSession : public Outlet, public std::enable_shared_from_this<SocketSession> {
 public:
  SocketSession(beast::tcp_stream stream, const SocketContext& context, std::shared_ptr<void> seat);

  /// Accepts the request, and serves the client until the connection ends.
  void run(Request request);

  void answer(std::string text) override { post({std::move(text), false}); }
  void deliver(std::string bytes) override;
  [[nodiscard]] bool busy() const override { return delivering_ > 0; }

 private:
  static constexpr std::size_t kMostAnswers = 4;  // that wait while a further message is read

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

  websocket::stream<beast::tcp_stream> socket_;
  const SocketContext& context_;
  const std::shared_ptr<void> seat_;
  Request request_;
  beast::flat_buffer buffer_;
  asio::steady_timer timer_;
  MessageRate rate_;
  int wrongMessages_ = 0;
  std::deque<Message> queue_;   ///< the first one is being written
  bool readsWhenSent_ = false;  ///< the next message is read when the queue is short again
  std::atomic<int> delivering_ = 0;
};

SocketSession::SocketSession(beast::tcp_stream stream, const SocketContext& context,
                             std::shared_ptr<void> seat)
    : socket_(std::move(stream)),
      context_(context),
      seat_(std::move(seat)),
      timer_(socket_.get_executor()),
      rate_(context.limits.messagesPerSecond, context.limits.messageBurst) {
  beast::get_lowest_layer(socket_).expires_never();  // the socket has its own times
  websocket::stream_base::timeout timeout{};
  timeout.handshake_timeout = context.limits.requestTime;
  timeout.idle_timeout = context.limits.idleTime;
  timeout.keep_alive_pings = true;
  socket_.set_option(timeout);
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
  asio::post(socket_.get_executor(),
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
  socket_.async_write(asio::buffer(queue_.front().bytes),
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

// Requests.

/// What connections work with. It outlives them.
struct HttpContext {
  Site site;
  std::string_view page;
  SocketContext socket;
  Seats clients;
  Seats requests;
};

/// Reads one request, and answers it or hands the connection to a SocketSession. It is a guest
/// until its request has the token.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(tcp::socket socket, HttpContext& context);
  void run();

  [[nodiscard]] bool isGuest() const { return !seat_; }
  /// Closes the connection.
  void drop();

 private:
  void onHead(error_code error);
  void serve(const Request& request);
  void openSocket(Request request);
  void send(Response response);
  void drain();

  beast::tcp_stream stream_;
  HttpContext& context_;
  std::shared_ptr<void> seat_;  ///< null for a guest
  beast::flat_buffer buffer_;
  http::request_parser<http::empty_body> parser_;
  Response response_;
  std::array<char, 4096> rest_{};  ///< bytes that nobody reads
};

HttpSession::HttpSession(tcp::socket socket, HttpContext& context)
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
    self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    self->drain();
  });
}

/// Reads until the client closes or its time is over. If a connection is closed before all was
/// read, the client may lose the answer.
void HttpSession::drain() {
  stream_.async_read_some(asio::buffer(rest_),
                          [self = shared_from_this()](error_code error, std::size_t) {
                            if (!error) self->drain();
                          });
}

// The server.

/// Accepts connections. Its functions, and those of its connections, are called by the thread that runs the context.
class Server {
 public:
  /// Listens.
  /// \throws RuntimeFailure  the address cannot be used
  Server(asio::io_context& io, const tcp::endpoint& at, HttpContext& context);

  [[nodiscard]] tcp::endpoint endpoint() const { return endpoint_; }
  /// Begins to accept connections.
  void run();

 private:
  void runLater();

  tcp::acceptor acceptor_;
  asio::steady_timer pause_;
  tcp::endpoint endpoint_;
  HttpContext& context_;
  Guests<HttpSession> guests_;
};

namespace {

tcp::acceptor listeningAt(asio::io_context& io, const tcp::endpoint& at) try {
  return tcp::acceptor(io, at);
} catch (const boost::system::system_error& error) {
  throw RuntimeFailure("cannot listen at " + at.address().to_string() + ", port " +
                       std::to_string(at.port()) + ": " + error.code().message());
}

}  // namespace

Server::Server(asio::io_context& io, const tcp::endpoint& at, HttpContext& context)
    : acceptor_(listeningAt(io, at)),
      pause_(io),
      endpoint_(acceptor_.local_endpoint()),
      context_(context),
      guests_(context.socket.limits.guests) {}

void Server::run() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    if (error) return runLater();
    error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    const auto session = std::make_shared<HttpSession>(std::move(socket), context_);
    guests_.admit(session);
    session->run();
    run();
  });
}

/// Waits a moment, because the error, such as too many open files, would occur again at once.
void Server::runLater() {
  constexpr std::chrono::milliseconds kPause{100};
  pause_.expires_after(kPause);
  pause_.async_wait([this](error_code error) {
    if (!error) run();
  });
}

// The service.

namespace {

std::string deviceText(const Device& device) {
  if (device.kind != DeviceKind::kCpu) return deviceName(device);
  using Control = tbb::global_control;
  const std::size_t threads = Control::active_value(Control::max_allowed_parallelism);
  return deviceName(device) + ", " + std::to_string(threads) + " thread" +
         (threads == 1 ? "" : "s");
}

}  // namespace

/// The part of a service that connections use and are made by.
struct Service::Connections {
  Connections(asio::io_context& io, Desk& desk, Studio& studio, const Settings& settings)
      : context{settings.site,
                viewPage(),
                {desk, studio, settings.limits},
                Seats(settings.limits.clients),
                Seats(settings.limits.requests)},
        server(io, settings.at, context) {
    server.run();
  }

  HttpContext context;
  Server server;
};

Service::Service(const Collection& collection, const Settings& settings)
    : io_(1),
      studio_(collection, settings.drawing),
      desk_(collection, studio_, deviceText(settings.drawing.device)),
      connections_(std::make_unique<Connections>(io_, desk_, studio_, settings)) {}

// Connections may outlive this call in handlers of the context, but the studio no longer sends.
Service::~Service() { studio_.stop(); }

tcp::endpoint Service::endpoint() const { return connections_->server.endpoint(); }

bool Service::endsWithin(std::chrono::milliseconds time) {
  stop();
  return studio_.endsWithin(time);
}

}  // namespace esvr::view
