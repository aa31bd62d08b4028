#pragma once
/// Draws a NanoVDB grid on a CUDA device. This header does not include those of NanoVDB.

#include <cuda_runtime_api.h>

#include <cstddef>

#include "esvr/nano_volume.h"
#include "render/ray_box.h"
#include "render/sample_rule.h"

namespace esvr::cuda {

struct NanoDrawArguments {
  View view;
  PlaceBox box;  ///< every sample outside this box is the background
  double step;
  ClipBox clip;
  SampleRule rule;
  const std::byte* grid;  ///< the NanoVDB grid, on the device
  NanoValues values;
  Resolution resolution;
  int firstRow, rows;  ///< rows of pixels of the band
  float4* pixels;      ///< pixels of the band
};

void launchNano(const NanoDrawArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
