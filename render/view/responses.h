#pragma once
/// The answers to requests that open no socket.

#include <boost/beast/http/string_body.hpp>
#include <string>
#include <string_view>

#include "render/view/request_rules.h"

namespace esvr::view {

using Response = http::response<http::string_body>;

/// The page, with a policy that lets only its own scripts run and lets it speak to this server only.
/// \param host  the Host header of the request, which judge() has accepted
/// \param page  its scripts and styles have kNoncePlace as their nonce
[[nodiscard]] Response pageResponse(std::string_view page, std::string_view host);
/// The text that is replaced by a random nonce.
inline constexpr std::string_view kNoncePlace = "ESVR-NONCE";

/// An answer with nothing but a status.
[[nodiscard]] Response statusResponse(http::status status);

}  // namespace esvr::view
