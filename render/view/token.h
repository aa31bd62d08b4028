#pragma once
/// The secret in the server's address.

#include <string>
#include <string_view>

namespace esvr::view {

/// 128 random bits of the system as 32 hexadecimal digits.
[[nodiscard]] std::string randomToken();

/// Compares in a time that does not depend on where the texts differ, so that the time of an answer
/// tells nothing about the token.
[[nodiscard]] bool sameSecret(std::string_view a, std::string_view b);

}  // namespace esvr::view
