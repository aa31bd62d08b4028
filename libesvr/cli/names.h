#pragma once
/// Words for what a file says in numbers.

#include <string>

#include "esvr/container.h"
#include "esvr/grid_descriptor.h"
#include "esvr/kernel.h"

namespace esvr::cli {

/// As OpenVDB has it: "level set", "fog volume", "staggered", "unknown".
[[nodiscard]] std::string nameOf(GridClass gridClass);
/// "float", "half", "double".
[[nodiscard]] std::string nameOf(ValueType type);
/// "continuous", "paper".
[[nodiscard]] std::string nameOf(KernelForm form);
/// "threshold", "bricks", "mask".
[[nodiscard]] std::string nameOf(TopologyKind kind);

/// Bytes of a grid's sections.
[[nodiscard]] std::uint64_t storedBytes(const EsvrSummary& file, std::size_t grid);

}  // namespace esvr::cli
