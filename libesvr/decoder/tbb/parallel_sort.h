#pragma once
/// Sorting on one thread (blocked_range.h).

#include <algorithm>

namespace tbb {

template <class Iterator>
void parallel_sort(Iterator first, Iterator last) {
  std::sort(first, last);
}

}  // namespace tbb
