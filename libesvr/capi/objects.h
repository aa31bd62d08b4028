#pragma once
/// The objects behind the C interface (esvr/esvr.h), and what makes statuses of exceptions.

#include <functional>
#include <string>
#include <utility>

#include "core/brick_index.h"
#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/esvr.h"
#include "esvr/sparse_volume.h"

struct esvr_file {
  esvr::EsvrFile content;
  std::string name;
};

struct esvr_volume {
  explicit esvr_volume(esvr::SparseVolume decoded)
      : voxels(std::move(decoded)), index(voxels.bricks) {}

  esvr::SparseVolume voxels;
  esvr::BrickIndex index;  ///< finds bricks by their positions relative to the origin
};

namespace esvr::capi {

/// Runs a task. Its exception becomes a status and the text of esvr_error().
esvr_status guarded(const std::function<void()>& task) noexcept;

inline void require(bool good, const char* otherwise) {
  if (!good) throw UsageError(otherwise);
}

}  // namespace esvr::capi
