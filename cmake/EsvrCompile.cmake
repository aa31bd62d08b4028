# How the files of the project are compiled: kernels, warnings, the optimisation of programs, and sanitizers.

# Kernels are inner loops with fused multiply-adds, and with instruction sets beyond the baseline that are chosen at
# run time. All functions with vector arguments are inlined, so the problem that -Wpsabi warns about cannot occur.

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

# The optimisation of code in which no time is spent: the programs and the Python module, which spend it in libesvr, and
# OpenVDB's trees. With -O1 it compiles in two thirds of the time or less (esvr_viewer: 42 instead of 57 s).
set(ESVR_COLD_OPTIMISATION "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-O1>" CACHE STRING
    "Compiler option of code in which no time is spent")
mark_as_advanced(ESVR_COLD_OPTIMISATION)

# Everything below is for every target of the project, but not if another project contains it.
if(NOT PROJECT_IS_TOP_LEVEL)
  return()
endif()

# Warnings are for those who change the code, in the presets that treat them as errors and under sanitizers. Without them,
# a unit of tests compiles in five sixths of the time (test_core: 24.5 instead of 29.1 s).
if(ESVR_WERROR OR ESVR_SANITIZE)
  set(warnings -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    list(APPEND warnings -Wno-restrict) # GCC bug 105651: false warnings about std::string's operator+
  endif()
  add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:${warnings}>")
  # CUDA code is compiled without -Wpedantic, which warns about line directives that nvcc generates.
  list(REMOVE_ITEM warnings -Wpedantic)
  list(JOIN warnings "," forHostCompiler)
  add_compile_options("$<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=${forHostCompiler}>")
endif()
if(ESVR_WERROR)
  add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:-Werror>"
                      "$<$<COMPILE_LANGUAGE:CUDA>:-Werror=all-warnings;-Xcompiler=-Werror>")
endif()

if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  # GCC collects garbage when its memory has doubled, and here not below 1 GB, which most units never need. The
  # collections of a unit of tests take 8 % of its time.
  add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:--param=ggc-min-heapsize=524288>")
endif()

if(ESVR_SANITIZE)
  set(ESVR_COLD_OPTIMISATION -O0)
  set(sanitize -fsanitize=${ESVR_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
    list(APPEND sanitize -fsanitize-ignorelist=${CMAKE_CURRENT_LIST_DIR}/sanitizer_ignorelist.txt)
  endif()
  if(ESVR_SANITIZE MATCHES address)
    # Checks of every pointer, which take a quarter of the time of a unit. The address sanitizer sees an access
    # through a wrong one.
    list(APPEND sanitize -fno-sanitize=null,object-size,pointer-overflow)
  endif()
  add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:${sanitize}>")
  add_link_options(-fsanitize=${ESVR_SANITIZE})
endif()
