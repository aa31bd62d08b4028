#include "capi/objects.h"

#include <new>
#include <stdexcept>

namespace esvr::capi {
namespace {

thread_local std::string lastError;

esvr_status fail(esvr_status status, const char* text) {
  try {
    lastError = text;
  } catch (const std::bad_alloc&) {
    lastError.clear();
  }
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

esvr_status guarded(const std::function<void()>& task) noexcept {
  try {
    task();
    return ESVR_OK;
  } catch (const Error& error) {
    return fail(statusOf(error.kind()), error.what());
  } catch (const std::bad_alloc&) {
    return fail(ESVR_MEMORY, "there is not enough memory");
  } catch (const std::length_error&) {
    return fail(ESVR_MEMORY, "an array would be larger than the address space");
  } catch (const std::exception& error) {
    return fail(ESVR_FAILED, error.what());
  }
}

}  // namespace esvr::capi

const char* esvr_error(void) { return esvr::capi::lastError.c_str(); }
