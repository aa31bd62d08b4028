#pragma once
/// Lets a search end with what it has found before a fit was cancelled.

#include "esvr/error.h"

namespace esvr::convert {

/// The result of `work`; an empty one if it was cancelled before it had one.
template <class Work>
[[nodiscard]] auto unlessCancelled(const Work& work) -> decltype(work()) try {
  return work();
} catch (const Cancelled&) {
  return {};
}

}  // namespace esvr::convert
