#include "field/window_kernels.h"

#include "field/instruction_sets.h"

namespace esvr {

namespace baseline {
extern const WindowKernels kWindowKernels;
}
#if defined(ESVR_X86_64)
namespace avx2 {
extern const WindowKernels kWindowKernels;
}
namespace avx512 {
extern const WindowKernels kWindowKernels;
}
#endif

std::vector<const WindowKernels*> runnableWindowKernels() {
  std::vector<const WindowKernels*> sets;
#if defined(ESVR_X86_64)
  if (runsAvx512()) sets.push_back(&avx512::kWindowKernels);
  if (runsAvx2()) sets.push_back(&avx2::kWindowKernels);
#endif
  sets.push_back(&baseline::kWindowKernels);
  return sets;
}

const WindowKernels& windowKernels() {
  static const WindowKernels& best = *runnableWindowKernels().front();
  return best;
}

}  // namespace esvr
