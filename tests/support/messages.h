#pragma once
/// Matchers of messages: what a text says, and what is said by an exception.

#include <gmock/gmock.h>

#include <string>
#include <type_traits>

namespace esvr::test {

/// A matcher is itself, and words are the matcher of a text that has them.
template <class Part>
testing::Matcher<const std::string&> hasPart(const Part& part) {
  if constexpr (std::is_convertible_v<const Part&, std::string>)
    return testing::HasSubstr(std::string(part));
  else
    return part;
}

/// A text with all of these words; in place of words, there may be a matcher of the whole text.
template <class... Parts>
testing::Matcher<const std::string&> Says(const Parts&... parts) {
  return testing::AllOf(testing::Matcher<const std::string&>(testing::_), hasPart(parts)...);
}

/// A call that throws this exception with a message of these parts.
template <class Exception, class... Parts>
auto ThrowsSaying(const Parts&... parts) {
  return testing::ThrowsMessage<Exception>(Says(parts...));
}

}  // namespace esvr::test
