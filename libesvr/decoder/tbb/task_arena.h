#pragma once
/// The only thread as an arena (blocked_range.h).

namespace tbb::this_task_arena {

[[nodiscard]] inline int max_concurrency() { return 1; }

template <class Work>
auto isolate(const Work& work) {
  return work();
}

}  // namespace tbb::this_task_arena
