#pragma once
/// Sorting on one thread (blocked_range.h).

#include <algorithm>

namespace tbb {

template <class Iterator>
void parallel_sort(Iterator first, Iterator last) requires requires {
  *first;
}
{ std::sort(first, last); }

template <class Container>
void parallel_sort(Container& container) {
  std::sort(container.begin(), container.end());
}

template <class Container, class Before>
void parallel_sort(Container& container, const Before& before) requires requires {
  container.begin();
}
{ std::sort(container.begin(), container.end(), before); }

}  // namespace tbb
