#pragma once
/// Reads the members of JSON objects that clients send. Every function throws a BadInput that names
/// the member if its value has the wrong form.

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "cli/choice.h"
#include "esvr/camera.h"
#include "esvr/error.h"

namespace esvr::view {

using nlohmann::json;

/// The members of an object, some of which may be missing. A member that is null counts as missing.
class Members {
 public:
  /// \param name  of the object in messages
  /// \throws BadInput  the value is no object
  Members(const json& object, std::string name);

  /// \throws BadInput  the object has a member of another name
  void requireKnown(std::initializer_list<std::string_view> names) const;

  /// The value of a member; null if it is missing.
  [[nodiscard]] const json* find(const char* name) const;
  /// \throws BadInput  it is missing
  [[nodiscard]] const json& at(const char* name) const;

  [[nodiscard]] std::optional<double> number(const char* name) const;
  /// A number within [low, high].
  [[nodiscard]] std::optional<double> number(const char* name, double low, double high) const;
  /// A whole number within [low, high].
  [[nodiscard]] std::optional<std::int64_t> whole(const char* name, std::int64_t low,
                                                  std::int64_t high) const;
  [[nodiscard]] std::optional<bool> flag(const char* name) const;
  [[nodiscard]] std::optional<std::string> text(const char* name) const;
  [[nodiscard]] std::optional<Vec3> vector(const char* name) const;

  /// The value that a word stands for.
  template <class T>
  [[nodiscard]] std::optional<T> choice(const char* name,
                                        std::initializer_list<cli::Choice<T>> choices) const {
    const auto word = text(name);
    if (!word) return std::nullopt;
    std::string words;
    for (const auto& c : choices) {
      if (*word == c.word) return c.value;
      words += (words.empty() ? "" : ", ") + std::string(c.word);
    }
    refuse(name, "must be one of " + words);
  }

  /// \throws BadInput  always: the member, followed by `what`
  [[noreturn]] void refuse(const std::string& name, const std::string& what) const;
  /// The name of a member in messages.
  [[nodiscard]] std::string nameOf(const std::string& member) const { return name_ + "." + member; }

 private:
  const json& object_;
  std::string name_;
};

/// The numbers of an array of a given length. \param name  of the array in messages
[[nodiscard]] std::vector<double> numbersOf(const json& array, std::size_t count,
                                            const std::string& name);

}  // namespace esvr::view
