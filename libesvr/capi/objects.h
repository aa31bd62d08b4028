#pragma once
/// The objects behind the C interface (esvr/esvr.h), and what makes statuses of exceptions.

#include <string>
#include <utility>

#include "core/brick_index.h"
#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/esvr.h"
#include "esvr/volume.h"

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

/// The status of the exception that is being handled, whose text esvr_error() then returns.
esvr_status statusOfException() noexcept;

/// Runs a task. Its exception becomes a status. The task is called directly: a std::function of it
/// might allocate memory, and fail, before the exceptions are caught.
template <class Task>
esvr_status guarded(const Task& task) noexcept {
  try {
    task();
    return ESVR_OK;
  } catch (...) {
    return statusOfException();
  }
}

inline void require(bool good, const char* otherwise) {
  if (!good) throw UsageError(otherwise);
}

}  // namespace esvr::capi
