#pragma once
/// The option --box.

#include <string>

#include "esvr/coord.h"

namespace esvr::cli {

/// Parses "x0,y0,z0,x1,y1,z1": the lowest and the highest voxel, both inside the box.
/// \throws UsageError  the text is not of this form, or the box is empty
[[nodiscard]] Box parseBox(const std::string& text, const std::string& option = "box");

}  // namespace esvr::cli
