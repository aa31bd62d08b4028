#pragma once
/// The rules that a grid must obey to be written. A reader refuses a grid that breaks them.

#include <optional>
#include <string>

#include "esvr/container.h"
#include "format/layout.h"

namespace esvr::format {

/// A broken rule, and the section whose content breaks it.
struct Fault {
  SectionKind section;
  std::string text;
};

/// A map whose number of bytes is not that of its type, if the type is one of OpenVDB's own. Grids
/// with such a map can be read, but no VDB file can be made of them.
[[nodiscard]] std::optional<Fault> mapFaultOf(const Transform& transform);

/// Checks all but bricks, curve and chunks: numbers must be finite, the kernel must be possible to
/// evaluate, and ranges must be in order.
[[nodiscard]] std::optional<Fault> faultOf(const StoredGrid& grid);

[[nodiscard]] std::optional<Fault> residualFaultOf(const StoredGrid& grid);

/// The components of a grid of vectors must agree in class, value type and transform.
[[nodiscard]] std::optional<Fault> faultOf(StoredComponents components);

/// Parameters must be finite, scales within kMaxLogScale and quaternions of unit length.
[[nodiscard]] std::optional<Fault> faultOf(const Ellipsoids& ellipsoids);

}  // namespace esvr::format
