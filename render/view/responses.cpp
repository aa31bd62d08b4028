#include "render/view/responses.h"

#include "render/view/token.h"

namespace esvr::view {
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
