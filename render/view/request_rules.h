#pragma once
/// What a request gets: rules, answers without a socket, and the secret in the server's address.

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/status.hpp>
#include <boost/beast/http/string_body.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace esvr::view {

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

}  // namespace esvr::view
