#include "esvr/error.h"
#include "esvr/progress.h"

namespace esvr {
namespace {

const CancelToken*& ownSlot() noexcept {
  thread_local const CancelToken* token = nullptr;
  return token;
}

CancelSlot slot = &ownSlot;  // changed once, when a module is loaded

}  // namespace

CancelSlot cancelSlot() noexcept { return slot; }
void useCancelSlot(CancelSlot other) noexcept { slot = other; }

CancelScope::CancelScope(const CancelToken* token) noexcept : outer_(slot()) { slot() = token; }
CancelScope::~CancelScope() { slot() = outer_; }

const CancelToken* CancelScope::token() noexcept { return slot(); }

void CancelScope::check() {
  if (cancelled()) throw Cancelled();
}

}  // namespace esvr
