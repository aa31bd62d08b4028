#pragma once
/// Runs the parts of a fit in chunks on the devices of several ranks.

#include <vector>

#include "esvr/device.h"
#include "esvr/part_runner.h"
#include "esvr/part_store.h"
#include "esvr/ranks.h"

namespace esvr {

class RankWorkers : public PartRunner {
 public:
  /// \param devices  devices of this rank, at least one
  /// \param store    keeps the results of parts; it may be null
  RankWorkers(Ranks& ranks, std::vector<Device> devices, PartStore* store);

  /// \throws RuntimeFailure  the ranks do not have the same parts
  /// \throws Error           what a part of this rank threw; the ranks must then be aborted
  std::vector<std::vector<std::byte>> run(const RoundParts& parts) override;

 private:
  Ranks& ranks_;
  std::vector<Device> devices_;
  PartStore* store_;
};

}  // namespace esvr
