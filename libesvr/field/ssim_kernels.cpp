#include "field/ssim_kernels.h"

#include "field/instruction_sets.h"

namespace esvr {

namespace baseline {
extern const SsimKernels kSsimKernels;
}
#if defined(ESVR_X86_64)
namespace avx2 {
extern const SsimKernels kSsimKernels;
}
namespace avx512 {
extern const SsimKernels kSsimKernels;
}
#endif

std::vector<const SsimKernels*> runnableSsimKernels() {
  std::vector<const SsimKernels*> sets;
#if defined(ESVR_X86_64)
  if (runsAvx512()) sets.push_back(&avx512::kSsimKernels);
  if (runsAvx2()) sets.push_back(&avx2::kSsimKernels);
#endif
  sets.push_back(&baseline::kSsimKernels);
  return sets;
}

const SsimKernels& ssimKernels() {
  static const SsimKernels& best = *runnableSsimKernels().front();
  return best;
}

}  // namespace esvr
