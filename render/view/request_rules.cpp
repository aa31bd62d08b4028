#include "render/view/request_rules.h"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>
#include <string_view>

#include "render/view/token.h"

namespace esvr::view {
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

/// Browsers send the origin of the page that opens a socket. Other programs send none; they know the
/// token.
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

}  // namespace esvr::view
