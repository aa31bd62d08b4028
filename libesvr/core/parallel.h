#pragma once
/// Loops on all threads that end when the token of the calling thread is set (esvr/device.h). They
/// are those of oneTBB. The decoder-only build has a file of this name with loops that nothing cancels, and with the part of
/// oneTBB that it uses, so that its sources include oneTBB through this header only.

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

#include <utility>

#include "esvr/device.h"

namespace esvr {

/// To be called in every step of a long loop on one thread. A step should take at most a few
/// milliseconds. \throws Cancelled  the token of the calling thread is set
inline void throwIfCancelled() { CancelScope::check(); }

/// Calls body(i) for every number from `first` to `last` - 1.
template <class Index, class Body>
void parallelFor(Index first, Index last, const Body& body) {
  if (!(first < last)) return;
  using Range = tbb::blocked_range<Index>;
  tbb::parallel_for(Range(first, last), [&, token = CancelScope::token()](const Range& part) {
    const CancelScope scope(token);
    for (Index i = part.begin(); i != part.end(); ++i) {
      throwIfCancelled();
      body(i);
    }
  });
}

/// Calls body(part) for parts of a range.
template <class Range, class Body>
void parallelFor(const Range& range, const Body& body) {
  tbb::parallel_for(range, [&, token = CancelScope::token()](const Range& part) {
    const CancelScope scope(token);
    throwIfCancelled();
    body(part);
  });
}

/// The values body(part, value) of parts of a range, joined by join(value, value).
template <class Range, class Value, class Body, class Join>
Value parallelReduce(const Range& range, const Value& identity, const Body& body,
                     const Join& join) {
  return tbb::parallel_reduce(
      range, identity,
      [&, token = CancelScope::token()](const Range& part, Value value) {
        const CancelScope scope(token);
        throwIfCancelled();
        return body(part, std::move(value));
      },
      join);
}

/// The same, divided and joined in the same order on any number of threads.
template <class Range, class Value, class Body, class Join>
Value parallelDeterministicReduce(const Range& range, const Value& identity, const Body& body,
                                  const Join& join) {
  return tbb::parallel_deterministic_reduce(
      range, identity,
      [&, token = CancelScope::token()](const Range& part, Value value) {
        const CancelScope scope(token);
        throwIfCancelled();
        return body(part, std::move(value));
      },
      join);
}

}  // namespace esvr
