#pragma once
/// Results that must not depend on the number of threads.

#include <tbb/global_control.h>

#include <cstddef>

namespace esvr::test {

/// \return what `make` returns where at most so many threads work
template <class Make>
auto onThreads(std::size_t threads, const Make& make) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  return make();
}

}  // namespace esvr::test
