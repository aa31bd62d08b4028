#pragma once
/// The quantised ellipsoids of a frame as the content of a section that refers to those of the
/// previous frame (docs/format.md, "Continued ellipsoids").

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/quantised.h"

namespace esvr::format {

/// True if ellipsoids can be stored as the continuation of others: some of them continue ellipsoids
/// of `before`, in their order and with their precisions, and the lattices agree.
[[nodiscard]] bool canContinue(const QuantisedEllipsoids& q, const QuantisedEllipsoids& before);

/// \param q  canContinue() is true
[[nodiscard]] std::vector<std::byte> putContinued(const QuantisedEllipsoids& q,
                                                  const QuantisedEllipsoids& before);

/// \throws BadInput  the content is damaged, or does not belong to these ellipsoids; the text begins
///                   with `where`
/// \throws MemoryExceeded  there are more ellipsoids than the budget allows
[[nodiscard]] QuantisedEllipsoids getContinued(std::span<const std::byte> content,
                                               const std::string& where,
                                               const QuantisedEllipsoids& before,
                                               MemoryBudget& budget);

}  // namespace esvr::format
