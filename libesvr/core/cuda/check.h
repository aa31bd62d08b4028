#pragma once
/// Converts CUDA's error codes to exceptions, in every build.

#include <cuda_runtime_api.h>

#include <source_location>
#include <string>
#include <string_view>

#include "esvr/error.h"

namespace esvr::cuda {

/// CUDA's own text, except where there is no driver at all, which CUDA calls an insufficient
/// driver.
inline std::string errorText(cudaError_t status) {
  int driver = 0;
  if (status == cudaErrorInsufficientDriver && cudaDriverGetVersion(&driver) == cudaSuccess &&
      driver == 0)
    return "no NVIDIA driver";
  return cudaGetErrorString(status);
}

/// Wraps every call of the CUDA runtime; after a launch, check(cudaGetLastError(), "name") is
/// called.
/// \param doing  text for the user that names what failed: "allocating 12 bytes"
/// \throws DeviceError  status is not cudaSuccess; the text has CUDA's own, the file and the line
inline void check(cudaError_t status, std::string_view doing,
                  std::source_location where = std::source_location::current()) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // clears the error, so that the next check() does not report it
  std::string_view file = where.file_name();
  file.remove_prefix(file.rfind('/') + 1);
  throw DeviceError("CUDA, " + std::string(doing) + ": " + errorText(status) + " (" +
                    cudaGetErrorName(status) + ", " + std::string(file) + ":" +
                    std::to_string(where.line()) + ")");
}

}  // namespace esvr::cuda
