#pragma once
/// Long calls that Ctrl-C ends.

#include <future>
#include <type_traits>
#include <utility>

#include "esvr/progress.h"
#include "python/src/objects.h"

namespace esvr::python {

/// Waits for a call on another thread with the GIL released. A signal that Python turns into an
/// exception sets the token; the exception is thrown when the call has ended.
template <class Result>
Result waitFor(std::future<Result>& call, CancelToken& token) {
  constexpr std::chrono::milliseconds kPoll{50};
  std::optional<py::error_already_set> raised;
  while (true) {
    {
      const py::gil_scoped_release release;
      if (call.wait_for(kPoll) == std::future_status::ready) break;
    }
    if (raised || PyErr_CheckSignals() == 0) continue;
    raised.emplace();
    token.cancel();
  }
  if (raised) {
    const py::gil_scoped_release release;
    call.wait();
  }
  if (raised) throw std::move(*raised);
  return call.get();
}

/// Runs a call that takes long on another thread. The loops of the library look at the token, so that
/// the call ends soon after Ctrl-C.
/// \param call  takes a CancelToken& or nothing; it must not use objects of Python
template <class Call>
auto interruptible(const Call& call) {
  CancelToken token;
  auto running = std::async(std::launch::async, [&] {
    const CancelScope scope(&token);
    if constexpr (std::is_invocable_v<Call, CancelToken&>)
      return call(token);
    else
      return call();
  });
  return waitFor(running, token);
}

}  // namespace esvr::python
