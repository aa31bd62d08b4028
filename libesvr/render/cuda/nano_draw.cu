#include "render/cuda/nano_draw.h"

#include <stdexcept>

#include "core/cuda/check.h"
#include "render/nano_march.h"

namespace esvr::cuda {
namespace {

constexpr unsigned kColumns = 8, kRows = 16;  // pixels of a block of threads

/// Where the pixels of a band are written.
struct BandPixels {
  int width, firstRow, rows;
  float4* pixels;
};

template <class Build>
__global__ void __launch_bounds__(kColumns* kRows)
    nanoKernel(const nanovdb::NanoGrid<Build>* grid, const MarchScene scene, const BandPixels out) {
  const int column = int(blockIdx.x * kColumns + threadIdx.x);
  const int row = int(blockIdx.y * kRows + threadIdx.y);
  if (column >= out.width || row >= out.rows) return;
  const PixelColor c = marchNano(*grid, scene, column, row + out.firstRow);
  out.pixels[std::size_t(row) * std::size_t(out.width) + std::size_t(column)] =
      make_float4(c.r, c.g, c.b, c.alpha);
}

template <class Build>
void launchAs(const NanoDrawArguments& a, cudaStream_t stream) {
  const dim3 threads(kColumns, kRows);
  const dim3 blocks((unsigned(a.resolution.width) + kColumns - 1) / kColumns,
                    (unsigned(a.rows) + kRows - 1) / kRows);
  const MarchScene scene{a.view, a.box, a.step, a.clip, a.rule};
  nanoKernel<Build>
      <<<blocks, threads, 0, stream>>>(reinterpret_cast<const nanovdb::NanoGrid<Build>*>(a.grid),
                                       scene, {a.resolution.width, a.firstRow, a.rows, a.pixels});
  check(cudaGetLastError(), "marching voxels");
}

}  // namespace

void launchNano(const NanoDrawArguments& a, cudaStream_t stream) {
  switch (a.values) {
    case NanoValues::kFloat:
      return launchAs<float>(a, stream);
    case NanoValues::kFp4:
      return launchAs<nanovdb::Fp4>(a, stream);
    case NanoValues::kFp8:
      return launchAs<nanovdb::Fp8>(a, stream);
    case NanoValues::kFp16:
      return launchAs<nanovdb::Fp16>(a, stream);
    case NanoValues::kFpN:
      return launchAs<nanovdb::FpN>(a, stream);
  }
  throw std::logic_error("launchNano: no such values");
}

}  // namespace esvr::cuda
