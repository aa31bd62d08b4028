#pragma once
/// Reductions on one thread (blocked_range.h).

#include <tbb/blocked_range.h>

namespace tbb {

template <class Value, class Result, class Body, class Join>
Result parallel_reduce(const blocked_range<Value>& range, const Result& identity, const Body& body,
                       const Join&) {
  return range.empty() ? identity : body(range, identity);
}

template <class Value, class Result, class Body, class Join>
Result parallel_deterministic_reduce(const blocked_range<Value>& range, const Result& identity,
                                     const Body& body, const Join& join) {
  return parallel_reduce(range, identity, body, join);
}

}  // namespace tbb
