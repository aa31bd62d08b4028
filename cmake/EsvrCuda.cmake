# Enables the language CUDA according to ESVR_CUDA, and sets ESVR_WITH_CUDA.
set(ESVR_WITH_CUDA OFF)
if(NOT ESVR_CUDA)
  return()
endif()

set(ESVR_CUDA_MINIMUM 12.0) # the first nvcc that supports C++20

# nvcc is often installed without being on PATH.
if(NOT CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
  find_program(ESVR_NVCC nvcc HINTS ENV CUDA_PATH PATHS /usr/local/cuda PATH_SUFFIXES bin)
  mark_as_advanced(ESVR_NVCC)
  if(ESVR_NVCC)
    set(CMAKE_CUDA_COMPILER ${ESVR_NVCC})
  endif()
endif()

# The default is the architecture that the project is measured on. The user may set another one.
if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
  set(CMAKE_CUDA_ARCHITECTURES 90 CACHE STRING "CUDA architectures")
endif()

include(CheckLanguage)
check_language(CUDA)
if(CMAKE_CUDA_COMPILER)
  enable_language(CUDA)
  if(CMAKE_CUDA_COMPILER_VERSION VERSION_GREATER_EQUAL ESVR_CUDA_MINIMUM)
    find_package(CUDAToolkit REQUIRED)
    # CMAKE_CUDA_STANDARD is not used, because CMake before 3.26 does not know nvcc's C++20.
    # Device code calls constexpr functions: those of std::array, Coord and voxel offsets.
    add_compile_options("$<$<COMPILE_LANGUAGE:CUDA>:-std=c++20;--expt-relaxed-constexpr>")
    set(ESVR_WITH_CUDA ON)
  endif()
endif()

# esvr_cuda_sources([FAST_MATH] <name> <files>...) adds CUDA files of the current folder to libesvr. In a unity build,
# which CMake has for C++ alone, they are one unit <name>.cu: most of the time of a unit is that of CUDA's headers (the
# lists, moves, steps and intensities of a fit take 30 s as one unit, and 88 s as four).
function(esvr_cuda_sources)
  cmake_parse_arguments(PARSE_ARGV 0 unit "FAST_MATH" "" "")
  list(POP_FRONT unit_UNPARSED_ARGUMENTS name)
  list(TRANSFORM unit_UNPARSED_ARGUMENTS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/ OUTPUT_VARIABLE files)
  if(CMAKE_UNITY_BUILD)
    list(TRANSFORM files REPLACE "(.+)" "#include \"\\1\"\n" OUTPUT_VARIABLE includes)
    string(CONCAT includes ${includes})
    set(files ${CMAKE_CURRENT_BINARY_DIR}/${name}.cu)
    file(CONFIGURE OUTPUT ${files} CONTENT "${includes}")
  endif()
  target_sources(esvr PRIVATE ${files})
  if(unit_FAST_MATH)
    set_source_files_properties(${files} TARGET_DIRECTORY esvr PROPERTIES COMPILE_OPTIONS -use_fast_math)
  endif()
endfunction()

if(ESVR_WITH_CUDA)
  message(STATUS "CUDA: ${CMAKE_CUDA_COMPILER_VERSION} for ${CMAKE_CUDA_ARCHITECTURES}")
elseif(ESVR_CUDA STREQUAL "AUTO")
  message(STATUS "CUDA: no nvcc of ${ESVR_CUDA_MINIMUM} or newer, building for the CPU only")
else()
  message(FATAL_ERROR "ESVR_CUDA is ${ESVR_CUDA} but there is no working nvcc of "
                      "${ESVR_CUDA_MINIMUM} or newer")
endif()
