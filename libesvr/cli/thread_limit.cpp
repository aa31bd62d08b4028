#include "cli/thread_limit.h"

#include <tbb/global_control.h>

namespace esvr::cli {

struct ThreadLimit::Control : tbb::global_control {
  explicit Control(int threads)
      : tbb::global_control(max_allowed_parallelism, std::size_t(threads)) {}
};

ThreadLimit::ThreadLimit(int threads)
    : control_(threads > 0 ? std::make_unique<Control>(threads) : nullptr) {}

ThreadLimit::~ThreadLimit() = default;

}  // namespace esvr::cli
