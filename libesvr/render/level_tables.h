#pragma once
/// The tables of a transfer function for the levels of detail of a picture.

#include <vector>

#include "render/level_of_detail.h"
#include "render/picture.h"

namespace esvr {

class LevelTables {
 public:
  /// \param picture  has the table of level 0; must outlive the object
  LevelTables(const Picture& picture, const RenderOptions& options, const LevelBounds& bounds)
      : picture_(picture), first_(std::max(1, bounds.first)) {
    for (int level = first_; level <= bounds.last; ++level)
      coarser_.emplace_back(options.transfer, samplingOf(options, LevelFrame{level}.side()));
  }

  /// \param level  from bounds.first to bounds.last
  [[nodiscard]] TransferTableView view(int level) const {
    return level == 0 ? picture_.table.view() : coarser_[std::size_t(level - first_)].view();
  }

 private:
  const Picture& picture_;
  int first_;
  std::vector<TransferTable> coarser_;
};

}  // namespace esvr
