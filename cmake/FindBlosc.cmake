# Finds c-blosc (version 1): target Blosc::blosc.
find_path(Blosc_INCLUDE_DIR blosc.h)
find_library(Blosc_LIBRARY blosc)
mark_as_advanced(Blosc_INCLUDE_DIR Blosc_LIBRARY)

if(Blosc_INCLUDE_DIR)
  file(STRINGS ${Blosc_INCLUDE_DIR}/blosc.h line REGEX "define BLOSC_VERSION_STRING ")
  string(REGEX REPLACE ".*\"([0-9.]+)[^\"]*\".*" "\\1" Blosc_VERSION "${line}")
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  Blosc
  REQUIRED_VARS Blosc_LIBRARY Blosc_INCLUDE_DIR
  VERSION_VAR Blosc_VERSION)

if(Blosc_FOUND AND NOT TARGET Blosc::blosc)
  add_library(Blosc::blosc UNKNOWN IMPORTED)
  set_target_properties(
    Blosc::blosc PROPERTIES IMPORTED_LOCATION ${Blosc_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES
                                                               ${Blosc_INCLUDE_DIR})
endif()
