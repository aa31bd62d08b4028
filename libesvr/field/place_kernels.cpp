#include "field/place_kernels.h"

#include "field/instruction_sets.h"

namespace esvr {

namespace baseline {
extern const AddPlaces kAddPlaces;
}
#if defined(ESVR_X86_64)
namespace avx2 {
extern const AddPlaces kAddPlaces;
}
namespace avx512 {
extern const AddPlaces kAddPlaces;
}
#endif

std::vector<AddPlaces> runnablePlaceKernels() {
  std::vector<AddPlaces> sets;
#if defined(ESVR_X86_64)
  if (runsAvx512()) sets.push_back(avx512::kAddPlaces);
  if (runsAvx2()) sets.push_back(avx2::kAddPlaces);
#endif
  sets.push_back(baseline::kAddPlaces);
  return sets;
}

AddPlaces placeKernel() {
  static const AddPlaces best = runnablePlaceKernels().front();
  return best;
}

}  // namespace esvr
