#include "render/view/token.h"

#include <sys/random.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "esvr/error.h"

namespace esvr::view {

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

}  // namespace esvr::view
