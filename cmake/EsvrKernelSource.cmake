# Inner loops use fused multiply-adds, and instruction sets beyond the baseline that are chosen at
# run time. All functions with vector arguments are inlined, so the problem that -Wpsabi warns about
# cannot occur.

# Adds a source of inner loops to a target, with further compiler options.
function(esvr_kernel_source target source)
  target_sources(${target} PRIVATE ${source})
  set_source_files_properties(
    ${source} TARGET_DIRECTORY ${target}
    PROPERTIES COMPILE_OPTIONS
               "-O3;-ffp-contract=fast;-fno-math-errno;-fno-trapping-math;-Wno-psabi;${ARGN}")
endfunction()

# Adds the sources of kernels to a target, one for each instruction set: NAME_baseline.cpp and, on
# x86-64, NAME_avx2.cpp and NAME_avx512.cpp.
function(esvr_kernels target name)
  esvr_kernel_source(${target} ${name}_baseline.cpp)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    target_compile_definitions(${target} PRIVATE ESVR_X86_64)
    esvr_kernel_source(${target} ${name}_avx2.cpp -march=x86-64-v3)
    esvr_kernel_source(${target} ${name}_avx512.cpp -march=x86-64-v4 -mprefer-vector-width=512)
  endif()
endfunction()
