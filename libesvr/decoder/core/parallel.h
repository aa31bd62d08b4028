#pragma once
/// The loops of core/parallel.h on the only thread of the decoder, where nothing cancels a call.

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

namespace esvr {

inline void throwIfCancelled() {}

template <class Index, class Body>
void parallelFor(Index first, Index last, const Body& body) {
  tbb::parallel_for(first, last, body);
}

template <class Range, class Body>
void parallelFor(const Range& range, const Body& body) {
  tbb::parallel_for(range, body);
}

template <class Range, class Value, class Body, class Join>
Value parallelReduce(const Range& range, const Value& identity, const Body& body,
                     const Join& join) {
  return tbb::parallel_reduce(range, identity, body, join);
}

template <class Range, class Value, class Body, class Join>
Value parallelDeterministicReduce(const Range& range, const Value& identity, const Body& body,
                                  const Join& join) {
  return tbb::parallel_deterministic_reduce(range, identity, body, join);
}

}  // namespace esvr
