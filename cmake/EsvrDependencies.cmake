# What libesvr needs, in one place for the build and for those who link a static libesvr:
# esvr_find_dependencies(find_package) here, esvr_find_dependencies(find_dependency) in
# esvrConfig.cmake. A macro, since imported targets belong to the folder that finds them.
macro(esvr_find_dependencies find)
  cmake_language(CALL ${find} Threads REQUIRED)
  cmake_language(CALL ${find} TBB REQUIRED)
  cmake_language(CALL ${find} OpenVDB 10.0 REQUIRED)
  cmake_language(CALL ${find} NanoVDB REQUIRED)
  cmake_language(CALL ${find} Blosc REQUIRED)
  cmake_language(CALL ${find} ZLIB REQUIRED)
  cmake_language(CALL ${find} xxHash REQUIRED)
endmacro()
