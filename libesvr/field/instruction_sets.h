#pragma once
/// Queries the instruction sets of this processor beyond those that all code is compiled for.

namespace esvr {

#if defined(ESVR_X86_64)
/// The parts of x86-64-v3 and x86-64-v4 that the kernels need.
inline bool runsAvx2() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
         __builtin_cpu_supports("bmi2");
}
inline bool runsAvx512() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
}
#endif

}  // namespace esvr
