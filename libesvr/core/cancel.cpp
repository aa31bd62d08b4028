#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr {
namespace {

thread_local const CancelToken* tokenOfThread = nullptr;

}  // namespace

CancelScope::CancelScope(const CancelToken* token) noexcept : outer_(tokenOfThread) {
  tokenOfThread = token;
}
CancelScope::~CancelScope() { tokenOfThread = outer_; }

const CancelToken* CancelScope::token() noexcept { return tokenOfThread; }

void CancelScope::check() {
  if (cancelled()) throw Cancelled();
}

}  // namespace esvr
