#pragma once
/// Codes the ellipsoids of a frame that continue ellipsoids of the previous frame, as differences
/// from predictions (docs/format.md, "Continued ellipsoids"). New ellipsoids are not coded here.

#include <optional>
#include <span>

#include "codec/symbol_coder.h"
#include "esvr/quantised.h"

namespace esvr::codec {

/// Largest number of octaves by which the steps of a lattice change from frame to frame.
inline constexpr int kMaxRefinement = 3;

/// The lattice with all steps smaller by a number of octaves; negative: with larger steps.
[[nodiscard]] Lattice refined(const Lattice& lattice, int octaves);

/// Largest distance of the lowest cells of two frames along an axis.
inline constexpr std::int64_t kMaxCellShift = std::int64_t{1} << 21;

/// The number of octaves by which a lattice is a refinement of another one. The cells of the two may
/// differ. The result is nothing if ellipsoids of one cannot continue those of the other, because
/// it is no refinement or its lowest cell is further away than kMaxCellShift.
[[nodiscard]] std::optional<int> refinementOf(const Lattice& lattice, const Lattice& before);

/// Codes which ellipsoids of `before` are continued, and their codes in `now`.
/// \param now  a writer takes its `continues` and codes; a reader has an empty one with a lattice.
///             Its `motion` is set
/// \throws BadInput  a reader: codes lie outside the lattice
void codeContinued(Writer& side, const QuantisedEllipsoids& before, QuantisedEllipsoids& now);
void codeContinued(Reader& side, const QuantisedEllipsoids& before, QuantisedEllipsoids& now);

/// What codes are chosen for.
struct ContinuedThrift {
  /// The exact ellipsoids, in the order of `now`. Null: codes of shapes stay as they are.
  const Ellipsoids* shapes = nullptr;
  std::span<const float> intensities{};  ///< the exact intensities, in the order of `now`
  /// The increase of the squared error, in squares of a quantisation step, for which a bit is saved.
  double bitPrice = 0.0;
};

/// Chooses the codes of the ellipsoids that continue others. Those of `now` are replaced; its
/// lattice, `continues` and size are set.
/// \throws RuntimeFailure  a value lies outside the lattice
void chooseContinued(const QuantisedEllipsoids& before, const ContinuedThrift& thrift,
                     QuantisedEllipsoids& now);

}  // namespace esvr::codec
