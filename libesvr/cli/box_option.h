#pragma once
/// --box.

#include <string>

#include "esvr/coord.h"

namespace esvr::cli {

/// "x0,y0,z0,x1,y1,z1": the smallest and the largest voxel, both within the box.
/// \throws UsageError  another text, an empty box
[[nodiscard]] Box parseBox(const std::string& text, const std::string& option = "box");

}  // namespace esvr::cli
