#pragma once
/// Options whose values are vectors or colors.

#include <optional>
#include <string>

#include "cli/command_line.h"
#include "esvr/camera.h"

namespace esvr::render {

/// The three numbers of an option. \return nothing if the option was not given
/// \throws UsageError  the value does not consist of three finite numbers
[[nodiscard]] std::optional<Vec3> findVector(const cli::Arguments& arguments,
                                             const std::string& option);

}  // namespace esvr::render
