#pragma once
/// Starts the marching of a NanoVDB grid on a CUDA device. Free of NanoVDB's headers.

#include <cuda_runtime_api.h>

#include <cstddef>

#include "esvr/nano_volume.h"
#include "render/ray_box.h"
#include "render/sample_rule.h"

namespace esvr::cuda {

struct NanoDrawArguments {
  View view;
  PlaceBox box;  ///< outside of it every sample is the background
  double step;
  ClipBox clip;
  SampleRule rule;
  const std::byte* grid;  ///< on the device
  NanoValues values;
  Resolution resolution;
  int firstRow, rows;  ///< the band's
  float4* pixels;      ///< the band's
};

void launchNano(const NanoDrawArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
