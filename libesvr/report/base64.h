#pragma once
/// Base64 (RFC 4648), for pictures within a page.

#include <string>
#include <string_view>

namespace esvr::report {

[[nodiscard]] std::string base64(std::string_view bytes);

}  // namespace esvr::report
