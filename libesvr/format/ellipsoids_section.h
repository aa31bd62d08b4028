#pragma once
/// A chunk's quantised ellipsoids as the content of a section: lattice, block table, streams.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "esvr/quantised.h"

namespace esvr::format {

/// \param q  of one layer
[[nodiscard]] std::vector<std::byte> putEllipsoids(const QuantisedEllipsoids& q);

/// \param count  what the chunk's record says; compared with the content before anything is
///               allocated
/// \throws BadInput  damaged; begins with `where`
[[nodiscard]] QuantisedEllipsoids getEllipsoids(std::span<const std::byte> content,
                                                std::uint64_t count, const std::string& where);

}  // namespace esvr::format
