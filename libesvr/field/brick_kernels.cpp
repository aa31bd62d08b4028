#include "field/brick_kernels.h"

#include "field/instruction_sets.h"

namespace esvr {

namespace baseline {
extern const BrickKernels kKernels;
}
#if defined(ESVR_X86_64)
namespace avx2 {
extern const BrickKernels kKernels;
}
namespace avx512 {
extern const BrickKernels kKernels;
}
#endif

std::vector<const BrickKernels*> runnableKernels() {
  std::vector<const BrickKernels*> sets;
#if defined(ESVR_X86_64)
  if (runsAvx512()) sets.push_back(&avx512::kKernels);
  if (runsAvx2()) sets.push_back(&avx2::kKernels);
#endif
  sets.push_back(&baseline::kKernels);
  return sets;
}

const BrickKernels& brickKernels() {
  static const BrickKernels& best = *runnableKernels().front();
  return best;
}

}  // namespace esvr
