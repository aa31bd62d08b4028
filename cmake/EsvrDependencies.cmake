# The packages that the project needs, and those that it uses if they are there. These are macros, because imported
# targets belong to the folder that finds them.

# Finds what libesvr needs. The build calls esvr_find_dependencies(find_package), and esvrConfig.cmake, with which this
# file is installed, calls esvr_find_dependencies(find_dependency) for users of a static libesvr.
macro(esvr_find_dependencies find)
  cmake_language(CALL ${find} Threads REQUIRED)
  cmake_language(CALL ${find} TBB REQUIRED)
  cmake_language(CALL ${find} OpenVDB 10.0 REQUIRED)
  cmake_language(CALL ${find} NanoVDB REQUIRED)
  cmake_language(CALL ${find} Blosc REQUIRED)
  cmake_language(CALL ${find} ZLIB REQUIRED)
  cmake_language(CALL ${find} xxHash REQUIRED)
endmacro()

# Looks for MPI according to ESVR_MPI, and sets ESVR_WITH_MPI.
macro(esvr_find_mpi)
  set(ESVR_WITH_MPI OFF)
  if(ESVR_MPI)
    set(MPI_CXX_SKIP_MPICXX ON) # only the C functions are used
    find_package(MPI QUIET COMPONENTS CXX)
    if(MPI_CXX_FOUND)
      set(ESVR_WITH_MPI ON)
      message(STATUS "MPI: ${MPI_CXX_VERSION}")
    elseif(ESVR_MPI STREQUAL "AUTO")
      message(STATUS "MPI: not found, a fit runs on one host")
    else()
      message(FATAL_ERROR "ESVR_MPI is ${ESVR_MPI} but there is no MPI")
    endif()
  endif()
endmacro()

# Looks for Python and pybind11 according to ESVR_PYTHON, and sets ESVR_WITH_PYTHON. The Python module draws, so that a
# build without the renderer has no module, nor has one with sanitizers, which Python itself would need.
macro(esvr_find_python)
  set(ESVR_WITH_PYTHON OFF)
  if(NOT ESVR_PYTHON STREQUAL OFF AND ESVR_BUILD_PROGRAMS AND NOT ESVR_CONVERTERS_ONLY AND NOT ESVR_SANITIZE)
    set(PYBIND11_FINDPYTHON ON)
    # The pybind11 and the NumPy of a distribution belong to its own Python, whatever comes first in PATH.
    find_path(pybind11Include pybind11/pybind11.h)
    if(NOT DEFINED Python_EXECUTABLE AND pybind11Include STREQUAL /usr/include)
      set(Python_EXECUTABLE /usr/bin/python3)
    endif()
    find_package(Python 3.9 COMPONENTS Interpreter Development.Module)
    find_package(pybind11 2.10 CONFIG)
    if(Python_Development.Module_FOUND AND pybind11_FOUND)
      set(ESVR_WITH_PYTHON ON)
    elseif(ESVR_PYTHON STREQUAL ON)
      message(FATAL_ERROR "The Python module needs pybind11 2.10 and Python's headers "
                          "(Debian: pybind11-dev, python3-dev)")
    endif()
  endif()
  message(STATUS "Python module: ${ESVR_WITH_PYTHON}")
endmacro()
