#include "render/view/request_rules.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <boost/asio/ip/address.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "esvr/error.h"

namespace esvr::view {

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

}  // namespace esvr::view
