#pragma once
/// Where the parts of a fit in chunks are run. A part is the fit of one chunk in one round
/// (docs/scale.md).

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "esvr/device.h"

namespace esvr {

/// A hash of everything that the result of a part depends on.
using PartKey = std::array<std::uint64_t, 2>;

/// The result of a part.
struct PartOutput {
  std::vector<std::byte> bytes;
  bool complete = true;  ///< false if the fit was cancelled: another run must not use the result
};

/// The parts of a round. They do not depend on each other. All functions may be called on several
/// threads at the same time.
class RoundParts {
 public:
  virtual ~RoundParts() = default;
  [[nodiscard]] virtual int round() const = 0;  ///< number of the round, from 0
  [[nodiscard]] virtual std::size_t count() const = 0;
  [[nodiscard]] virtual PartKey keyOf(std::size_t part) const = 0;
  /// Fits a part. After a cancellation it returns at once.
  [[nodiscard]] virtual PartOutput fit(std::size_t part, const Device& device) const = 0;
};

/// Runs the parts of a round. The result does not depend on the implementation.
class PartRunner {
 public:
  virtual ~PartRunner() = default;
  /// \return PartOutput::bytes of every part, in order
  [[nodiscard]] virtual std::vector<std::vector<std::byte>> run(const RoundParts& parts) = 0;
};

}  // namespace esvr
