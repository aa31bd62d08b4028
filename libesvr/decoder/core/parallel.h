#pragma once
/// The loops of core/parallel.h, and the part of oneTBB's interface that the decoder uses, on its only thread, where nothing
/// cancels a call. The decoder-only build has this folder on its include path before the library, so that it compiles the
/// same sources without oneTBB.

#include <algorithm>
#include <array>
#include <cstddef>

namespace tbb {

/// An interval of numbers. It is never divided.
template <class Value>
class blocked_range {
 public:
  blocked_range(Value begin, Value end, std::size_t grain = 1) : begin_(begin), end_(end) {
    (void)grain;
  }
  [[nodiscard]] Value begin() const { return begin_; }
  [[nodiscard]] Value end() const { return end_; }
  [[nodiscard]] bool empty() const { return !(begin_ < end_); }

 private:
  Value begin_, end_;
};

/// The values of all threads, of which there is one.
template <class Value>
class enumerable_thread_specific {
 public:
  [[nodiscard]] Value& local() { return values_[0]; }
  [[nodiscard]] auto begin() const { return values_.begin(); }
  [[nodiscard]] auto end() const { return values_.end(); }

 private:
  std::array<Value, 1> values_{};
};

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

/// The only thread as an arena.
namespace this_task_arena {

[[nodiscard]] inline int max_concurrency() { return 1; }

template <class Work>
auto isolate(const Work& work) {
  return work();
}

}  // namespace this_task_arena

}  // namespace tbb

namespace esvr {

inline void throwIfCancelled() {}

template <class Index, class Body>
void parallelFor(Index first, Index last, const Body& body) {
  for (Index i = first; i < last; ++i) body(i);
}

template <class Range, class Body>
void parallelFor(const Range& range, const Body& body) {
  if (!range.empty()) body(range);
}

template <class Range, class Value, class Body, class Join>
Value parallelReduce(const Range& range, const Value& identity, const Body& body, const Join&) {
  return range.empty() ? identity : body(range, identity);
}

template <class Range, class Value, class Body, class Join>
Value parallelDeterministicReduce(const Range& range, const Value& identity, const Body& body,
                                  const Join& join) {
  return parallelReduce(range, identity, body, join);
}

}  // namespace esvr
