#pragma once
/// Any exception as a kind and a text.

#include <string>

#include "esvr/error.h"

namespace esvr::cli {

/// The exception that is being handled, as an Error with the kind whose value is the exit code. To
/// be called in a catch clause.
[[nodiscard]] Error currentFailure();

}  // namespace esvr::cli
