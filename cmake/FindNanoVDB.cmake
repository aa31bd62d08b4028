# Finds the headers of NanoVDB: target NanoVDB::nanovdb.
find_path(NanoVDB_INCLUDE_DIR nanovdb/NanoVDB.h)
mark_as_advanced(NanoVDB_INCLUDE_DIR)

if(NanoVDB_INCLUDE_DIR)
  set(NanoVDB_VERSION "")
  foreach(part MAJOR MINOR PATCH)
    file(STRINGS ${NanoVDB_INCLUDE_DIR}/nanovdb/NanoVDB.h line
         REGEX "define NANOVDB_${part}_VERSION_NUMBER ")
    string(REGEX REPLACE ".*NUMBER +([0-9]+).*" "\\1" number "${line}")
    list(APPEND NanoVDB_VERSION ${number})
  endforeach()
  list(JOIN NanoVDB_VERSION "." NanoVDB_VERSION)
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  NanoVDB
  REQUIRED_VARS NanoVDB_INCLUDE_DIR
  VERSION_VAR NanoVDB_VERSION)

if(NanoVDB_FOUND AND NOT TARGET NanoVDB::nanovdb)
  add_library(NanoVDB::nanovdb INTERFACE IMPORTED)
  target_include_directories(NanoVDB::nanovdb INTERFACE ${NanoVDB_INCLUDE_DIR})
endif()
