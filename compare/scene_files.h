#pragma once
/// Reads and checks the reference of `table` and `curves`.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compare/measure.h"
#include "compare/scratch_folder.h"
#include "compare/table_options.h"

namespace esvr::compare {

/// Owns the objects that a TableScene points to.
class SceneFiles {
 public:
  /// \throws BadInput  the reference has no active voxel; else as for readGrid
  SceneFiles(const TableOptions& options, const CancelToken& cancel);

  [[nodiscard]] TableScene scene() const;
  /// A record without rows.
  [[nodiscard]] TableRecord record() const;

 private:
  const TableOptions& options_;
  const CancelToken& cancel_;
  GridFile file_;
  std::size_t place_;
  VolumeGrid reference_;
  Box box_;
  double peak_;
  ScratchFolder folder_;
  std::optional<Gallery> gallery_;
};

}  // namespace esvr::compare
