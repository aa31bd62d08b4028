#pragma once
/// The rules that a grid must obey to be written and to be believed. They are the same both ways.

#include <optional>
#include <string>

#include "esvr/container.h"
#include "format/layout.h"

namespace esvr::format {

/// A broken rule and the section whose content breaks it.
struct Fault {
  SectionKind section;
  std::string text;
};

/// All but leaves, curve and chunks: finite numbers, a kernel that can be evaluated, ranges.
[[nodiscard]] std::optional<Fault> faultOf(const StoredGrid& grid);

[[nodiscard]] std::optional<Fault> residualFaultOf(const StoredGrid& grid);

/// Parameters must be finite, scales within kMaxLogScale and quaternions of unit length.
[[nodiscard]] std::optional<Fault> faultOf(const Ellipsoids& ellipsoids);

}  // namespace esvr::format
