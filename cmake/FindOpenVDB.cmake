# Finds OpenVDB, which installs no package file of its own: target OpenVDB::openvdb.
find_path(OpenVDB_INCLUDE_DIR openvdb/openvdb.h)
find_library(OpenVDB_LIBRARY openvdb)
mark_as_advanced(OpenVDB_INCLUDE_DIR OpenVDB_LIBRARY)

if(OpenVDB_INCLUDE_DIR)
  file(STRINGS ${OpenVDB_INCLUDE_DIR}/openvdb/version.h line
       REGEX "define OPENVDB_LIBRARY_VERSION_STRING ")
  string(REGEX REPLACE ".*\"([0-9.]+)\".*" "\\1" OpenVDB_VERSION "${line}")
  file(STRINGS ${OpenVDB_INCLUDE_DIR}/openvdb/version.h usesImath
       REGEX "^#define OPENVDB_USE_IMATH_HALF")
endif()
set(required OpenVDB_LIBRARY OpenVDB_INCLUDE_DIR)
if(usesImath)
  # OpenVDB's headers have inline conversions that need a table of Imath. Imath's own package file
  # names a library that Debian does not install with it, so the library is searched here.
  find_library(OpenVDB_Imath_LIBRARY Imath)
  mark_as_advanced(OpenVDB_Imath_LIBRARY)
  list(APPEND required OpenVDB_Imath_LIBRARY)
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  OpenVDB
  REQUIRED_VARS ${required}
  VERSION_VAR OpenVDB_VERSION)

if(OpenVDB_FOUND AND NOT TARGET OpenVDB::openvdb)
  include(CMakeFindDependencyMacro)
  find_dependency(TBB)
  add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
  set_target_properties(
    OpenVDB::openvdb PROPERTIES IMPORTED_LOCATION ${OpenVDB_LIBRARY}
                                INTERFACE_INCLUDE_DIRECTORIES ${OpenVDB_INCLUDE_DIR})
  target_link_libraries(OpenVDB::openvdb INTERFACE TBB::tbb)
  if(usesImath)
    target_link_libraries(OpenVDB::openvdb INTERFACE ${OpenVDB_Imath_LIBRARY})
  endif()
endif()
