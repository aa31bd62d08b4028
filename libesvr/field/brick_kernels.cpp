/// Chooses the inner loops for the instruction set of this processor. Each brick_kernels_*.cpp defines one
/// table of each kind.

#include "field/brick_kernels.h"

#include "field/ssim_window.h"

namespace esvr {

namespace baseline {
extern const BrickKernels kKernels;
extern const AddPlaces kAddPlaces;
extern const SsimKernels kSsimKernels;
}  // namespace baseline

#if defined(ESVR_X86_64)
namespace avx2 {
extern const BrickKernels kKernels;
extern const AddPlaces kAddPlaces;
extern const SsimKernels kSsimKernels;
}  // namespace avx2
namespace avx512 {
extern const BrickKernels kKernels;
extern const AddPlaces kAddPlaces;
extern const SsimKernels kSsimKernels;
}  // namespace avx512

namespace {

/// The parts of x86-64-v3 and x86-64-v4 that the kernels need.
bool runsAvx2() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
         __builtin_cpu_supports("bmi2");
}
bool runsAvx512() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
}

/// Those tables of a kind that this processor can run, the best first.
template <class Table>
std::vector<Table> runnable(Table avx512, Table avx2, Table baseline) {
  std::vector<Table> sets;
  if (runsAvx512()) sets.push_back(avx512);
  if (runsAvx2()) sets.push_back(avx2);
  sets.push_back(baseline);
  return sets;
}

}  // namespace

std::vector<const BrickKernels*> runnableKernels() {
  return runnable(&avx512::kKernels, &avx2::kKernels, &baseline::kKernels);
}
std::vector<AddPlaces> runnablePlaceKernels() {
  return runnable(avx512::kAddPlaces, avx2::kAddPlaces, baseline::kAddPlaces);
}
std::vector<const SsimKernels*> runnableSsimKernels() {
  return runnable(&avx512::kSsimKernels, &avx2::kSsimKernels, &baseline::kSsimKernels);
}

#else

std::vector<const BrickKernels*> runnableKernels() { return {&baseline::kKernels}; }
std::vector<AddPlaces> runnablePlaceKernels() { return {baseline::kAddPlaces}; }
std::vector<const SsimKernels*> runnableSsimKernels() { return {&baseline::kSsimKernels}; }

#endif

const BrickKernels& brickKernels() {
  static const BrickKernels& best = *runnableKernels().front();
  return best;
}
AddPlaces placeKernel() {
  static const AddPlaces best = runnablePlaceKernels().front();
  return best;
}
const SsimKernels& ssimKernels() {
  static const SsimKernels& best = *runnableSsimKernels().front();
  return best;
}

}  // namespace esvr
