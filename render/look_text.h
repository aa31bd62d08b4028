#pragma once
/// The texts of the options that say how a grid looks.

#include <optional>
#include <string>

#include "render/options.h"

namespace esvr::render {

struct LookText {
  std::optional<std::string> colors, opacity, tf, preset;
  std::string range = "auto";
};

/// \param usualColors  color map unless one is given
/// \throws UsageError  the texts are wrong or exclude each other
/// \throws BadInput    the file of a transfer function is wrong
[[nodiscard]] Look lookOf(const LookText& text, const std::string& usualColors);

/// Reads the text of --with: NAME[:KEY=VALUE]...[:emission]
/// \throws UsageError, BadInput  as for lookOf
[[nodiscard]] FurtherGrid furtherGridOf(const std::string& text);

}  // namespace esvr::render
