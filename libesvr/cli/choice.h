#pragma once
/// Options whose values are words.

#include <initializer_list>
#include <string>

#include "esvr/error.h"

namespace esvr::cli {

template <class T>
struct Choice {
  const char* word;
  T value;
};

/// The value of a word. \throws UsageError  the word is unknown; the message lists the known ones
template <class T>
T choose(const std::string& option, const std::string& given,
         std::initializer_list<Choice<T>> choices) {
  std::string words;
  for (const auto& choice : choices) {
    if (given == choice.word) return choice.value;
    words += (words.empty() ? "" : ", ") + std::string(choice.word);
  }
  throw UsageError("--" + option + " must be one of " + words + ", not '" + given + "'");
}

}  // namespace esvr::cli
