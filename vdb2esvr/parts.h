#pragma once
/// Decides where the parts of fits in chunks run (docs/scale.md).

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "esvr/device.h"
#include "esvr/part_store.h"
#include "esvr/ranks.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

/// The folder of a run's finished parts: that of OUT.esvr is OUT.esvr.parts.
[[nodiscard]] std::filesystem::path partsFolder(const Options& options);

class Parts {
 public:
  /// Opens the folder of finished parts for --resume.
  /// \param device  the device that fits parts
  /// \param ranks   the processes that share the parts; may be null
  /// \throws BadInput  the folder belongs to another input, to other options or to fits on another
  ///                   kind of device
  Parts(const Options& options, const Device& device, Ranks* ranks);

  /// \param devices  the devices that fit parts; the runner is valid until the next call
  /// \param onLost   is told when one of several devices fails
  [[nodiscard]] PartRunner* runOn(const std::vector<Device>& devices, LostDevice onLost);

  /// True if the parts are shared with the ranks of MPI, which must all do the same.
  [[nodiscard]] bool haveRanks() const { return ranks_ != nullptr; }

  /// Removes the folder.
  void remove();

 private:
  Ranks* ranks_;
  std::optional<PartStore> store_;
  std::unique_ptr<PartRunner> runner_;
};

}  // namespace esvr::vdb2esvr
