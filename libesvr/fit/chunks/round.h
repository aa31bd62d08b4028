#pragma once
/// A round of a fit in chunks: every chunk is fitted with its halo for a part of the schedule. The
/// parts begin with the ellipsoids of the round before and do not see each other.

#include <cstddef>
#include <span>
#include <vector>

#include "esvr/part_runner.h"
#include "fit/chunks/chunk_state.h"
#include "fit/chunks/device_turns.h"
#include "fit/chunks/part.h"
#include "fit/chunks/whole_progress.h"

namespace esvr {

struct RoundPlan {
  int number = 0;
  Kernel kernel;
};

class Round : public RoundParts {
 public:
  /// All arguments must outlive the round.
  Round(const FitScene& scene, const RoundPlan& plan, std::span<const ChunkState> states,
        WholeProgress& progress, DeviceTurns& turns)
      : scene_(scene), plan_(plan), states_(states), progress_(progress), turns_(turns) {}

  [[nodiscard]] int round() const override { return plan_.number; }
  [[nodiscard]] std::size_t count() const override { return states_.size(); }
  [[nodiscard]] PartKey keyOf(std::size_t part) const override;
  [[nodiscard]] PartOutput fit(std::size_t part, const Device& device) const override;

 private:
  [[nodiscard]] bool cancelled() const;
  [[nodiscard]] PartStart startOf(std::size_t chunk) const;
  [[nodiscard]] PartEnd notFitted(const PartStart& start) const;
  [[nodiscard]] PartEnd fitted(const PartStart& start, const Device& device) const;
  [[nodiscard]] RunPlan runPlanOf(std::size_t chunk) const;
  void takeAround(std::size_t chunk, PartStart& start) const;
  struct Halo {
    Box box;        ///< box of bricks
    Box possible;   ///< bricks from which ellipsoids may reach into it
    double radius;  ///< radius of a support, relative to its scales
  };
  [[nodiscard]] double takeFrom(std::size_t other, const Halo& halo, PartStart& start) const;
  [[nodiscard]] double shareWithin(const Box& box, const BrickChunk& chunk) const;

  const FitScene& scene_;
  RoundPlan plan_;
  std::span<const ChunkState> states_;
  WholeProgress& progress_;
  DeviceTurns& turns_;
};

}  // namespace esvr
