# Builds the Python module if it is wanted and pybind11 is there. The module draws, so that a build
# without the renderer has no module, nor has one with sanitizers, which Python itself would need.
set(ESVR_WITH_PYTHON OFF)
set(ESVR_PYTHON_PROGRAMS) # integrations/python
if(NOT ESVR_PYTHON STREQUAL OFF AND ESVR_BUILD_PROGRAMS AND NOT ESVR_CONVERTERS_ONLY
   AND NOT ESVR_SANITIZE)
  set(PYBIND11_FINDPYTHON ON)
  # The pybind11 and the NumPy of a distribution belong to its own Python, whatever comes first in
  # PATH.
  find_path(pybind11Include pybind11/pybind11.h)
  if(NOT DEFINED Python_EXECUTABLE AND pybind11Include STREQUAL /usr/include)
    set(Python_EXECUTABLE /usr/bin/python3)
  endif()
  find_package(Python 3.9 COMPONENTS Interpreter Development.Module)
  find_package(pybind11 2.10 CONFIG)
  if(Python_Development.Module_FOUND AND pybind11_FOUND)
    set(ESVR_WITH_PYTHON ON)
    add_subdirectory(integrations/python)
  elseif(ESVR_PYTHON STREQUAL ON)
    message(FATAL_ERROR "The Python module needs pybind11 2.10 and Python's headers "
                        "(Debian: pybind11-dev, python3-dev)")
  endif()
endif()
message(STATUS "Python module: ${ESVR_WITH_PYTHON}")
