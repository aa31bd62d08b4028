#pragma once
/// A grid of ellipsoids as its difference from the same grid of the previous frame.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/container.h"

namespace esvr::format {

/// The content of a section of the kind kContinued; nothing if the ellipsoids of the grid do not
/// continue those of the previous one.
[[nodiscard]] std::optional<std::vector<std::byte>> putContinuedGrid(const StoredGrid& grid,
                                                                     const StoredGrid& previous);

/// \throws BadInput  the content is damaged, or does not belong to this previous grid; the text
///                   begins with `where`
/// \throws MemoryExceeded  there are more ellipsoids than the budget allows
[[nodiscard]] StoredGrid getContinuedGrid(std::span<const std::byte> content,
                                          const std::string& where, const StoredGrid& previous,
                                          MemoryBudget& budget);

}  // namespace esvr::format
