#pragma once
/// Files that the tests of the viewer show.

#include <filesystem>
#include <string>

#include "support/temporary_folder.h"

namespace esvr::test {

/// A folder with a blob of ellipsoids, `blob.esvr`, whose grid is named "density"; with its voxels,
/// `blob.vdb`; and with a sequence of two frames, `frames.esvr`, whose numbers are 7 and 9.
class ViewFiles {
 public:
  ViewFiles();
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const {
    return folder_ / name;
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace esvr::test
