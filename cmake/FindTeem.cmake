# Finds teem, which reads NRRD images: target Teem::teem. Teem's own package file defines no target.
find_path(Teem_INCLUDE_DIR teem/nrrd.h)
find_library(Teem_LIBRARY teem)
mark_as_advanced(Teem_INCLUDE_DIR Teem_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Teem REQUIRED_VARS Teem_LIBRARY Teem_INCLUDE_DIR)

if(Teem_FOUND AND NOT TARGET Teem::teem)
  add_library(Teem::teem UNKNOWN IMPORTED)
  set_target_properties(
    Teem::teem PROPERTIES IMPORTED_LOCATION ${Teem_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES
                                                            ${Teem_INCLUDE_DIR})
endif()
