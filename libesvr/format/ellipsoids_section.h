#pragma once
/// The quantised ellipsoids of a chunk as the content of a section: quantisation lattice, block
/// table, streams.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "esvr/quantised.h"

namespace esvr::format {

/// \param q  ellipsoids without layers
[[nodiscard]] std::vector<std::byte> putEllipsoids(const QuantisedEllipsoids& q);

/// \param count  number of ellipsoids in the chunk's record, which is compared with the content
///               before memory is allocated
/// \throws BadInput  the content is damaged; the text begins with `where`
[[nodiscard]] QuantisedEllipsoids getEllipsoids(std::span<const std::byte> content,
                                                std::uint64_t count, const std::string& where);

}  // namespace esvr::format
