#include "capi/objects.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string_view>

namespace esvr::capi {
namespace {

/// The text of the last failure. It must be kept when there is no memory left, so that it is not
/// allocated; a text that is longer ends in "...". Texts have a path of at most 4,096 bytes in them.
thread_local std::array<char, 4608> lastText{};

esvr_status fail(esvr_status status, const char* text) noexcept {
  constexpr std::string_view kCut = "...";
  const std::size_t most = lastText.size() - 1, bytes = std::min(std::strlen(text), most);
  std::memmove(lastText.data(), text, bytes);
  lastText[bytes] = '\0';
  if (bytes == most) std::ranges::copy(kCut, lastText.begin() + std::ptrdiff_t(most - kCut.size()));
  return status;
}

esvr_status statusOf(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::kUsage:
      return ESVR_USAGE;
    case ErrorKind::kBadInput:
      return ESVR_BAD_INPUT;
    case ErrorKind::kDevice:
      return ESVR_MEMORY;
    default:
      return ESVR_FAILED;
  }
}

}  // namespace

esvr_status statusOfException() noexcept {
  try {
    throw;
  } catch (const Error& error) {
    return fail(statusOf(error.kind()), error.what());
  } catch (const std::bad_alloc&) {
    return fail(ESVR_MEMORY, "there is not enough memory");
  } catch (const std::length_error&) {
    return fail(ESVR_MEMORY, "an array would be larger than the address space");
  } catch (const std::exception& error) {
    return fail(ESVR_FAILED, error.what());
  } catch (...) {
    return fail(ESVR_FAILED, "an unknown failure");
  }
}

}  // namespace esvr::capi

const char* esvr_error(void) { return esvr::capi::lastText.data(); }
