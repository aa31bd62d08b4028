#pragma once
// The standard library of Debian 12's Emscripten (libc++ 13) lacks some of C++20. This header, which
// is included before every file of the page's module, adds the parts that the decoder uses, in the
// forms in which it uses them. It can be removed when that library has them.

#include <algorithm>
#include <bit>
#include <functional>
#include <iterator>
#include <type_traits>

#if _LIBCPP_VERSION < 14000
namespace std {

template <class To, class From>
constexpr To bit_cast(const From& from) noexcept {
  static_assert(sizeof(To) == sizeof(From));
  return __builtin_bit_cast(To, from);
}

}  // namespace std
#endif

#if _LIBCPP_VERSION < 15000
namespace std::ranges {

struct same {
  template <class Value>
  constexpr Value&& operator()(Value&& value) const noexcept {
    return std::forward<Value>(value);
  }
};

template <class Range, class Value>
auto count(Range&& range, const Value& value) {
  return std::count(range.begin(), range.end(), value);
}
template <class Range, class Test>
auto count_if(Range&& range, Test test) {
  return std::count_if(range.begin(), range.end(), test);
}
template <class Range, class Test>
bool all_of(Range&& range, Test test) {
  return std::all_of(range.begin(), range.end(), test);
}
template <class Range, class Test>
bool any_of(Range&& range, Test test) {
  return std::any_of(std::begin(range), std::end(range), test);
}
template <class Range, class Value, class Projection = same>
auto find(Range&& range, const Value& value, Projection projection = {}) {
  return std::find_if(range.begin(), range.end(), [&](const auto& element) {
    return std::invoke(projection, element) == value;
  });
}
template <class Range, class Test>
auto find_if(Range&& range, Test test) {
  return std::find_if(range.begin(), range.end(), test);
}
template <class Range, class Other, class Test = std::equal_to<>, class Own = same,
          class Its = same>
bool equal(Range&& range, Other&& other, Test test = {}, Own own = {}, Its its = {}) {
  return std::equal(
      range.begin(), range.end(), other.begin(), other.end(),
      [&](const auto& a, const auto& b) { return test(std::invoke(own, a), std::invoke(its, b)); });
}
template <class Range, class Value, class Projection = same>
auto lower_bound(Range&& range, const Value& value, std::less<> = {}, Projection projection = {}) {
  return std::lower_bound(range.begin(), range.end(), value, [&](const auto& a, const auto& b) {
    return std::invoke(projection, a) < b;
  });
}
template <class Range, class Value>
auto upper_bound(Range&& range, const Value& value) {
  return std::upper_bound(range.begin(), range.end(), value);
}
template <class Range, class Value>
bool binary_search(Range&& range, const Value& value) {
  return std::binary_search(range.begin(), range.end(), value);
}
template <class Range, class Test>
auto adjacent_find(Range&& range, Test test) {
  return std::adjacent_find(range.begin(), range.end(), test);
}
template <class Range>
void sort(Range&& range) {
  std::sort(range.begin(), range.end());
}
template <class Range, class Value>
void fill(Range&& range, const Value& value) {
  std::fill(range.begin(), range.end(), value);
}
template <class Output>
struct copied {
  Output out;
};
template <class Range, class Output>
copied<Output> copy(Range&& range, Output out) {
  return {std::copy(range.begin(), range.end(), out)};
}
template <class Range, class Output, class Function>
void transform(Range&& range, Output out, Function function) {
  std::transform(range.begin(), range.end(), out, function);
}
template <class Range, class Other, class Output>
void set_union(Range&& range, Other&& other, Output out) {
  std::set_union(range.begin(), range.end(), other.begin(), other.end(), out);
}

}  // namespace std::ranges
#endif
