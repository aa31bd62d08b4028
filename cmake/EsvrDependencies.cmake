# Finds the packages that libesvr needs. The build calls esvr_find_dependencies(find_package), and
# esvrConfig.cmake calls esvr_find_dependencies(find_dependency) for users of a static libesvr. It
# is a macro, because imported targets belong to the folder that finds them.
macro(esvr_find_dependencies find)
  cmake_language(CALL ${find} Threads REQUIRED)
  cmake_language(CALL ${find} TBB REQUIRED)
  cmake_language(CALL ${find} OpenVDB 10.0 REQUIRED)
  cmake_language(CALL ${find} NanoVDB REQUIRED)
  cmake_language(CALL ${find} Blosc REQUIRED)
  cmake_language(CALL ${find} ZLIB REQUIRED)
  cmake_language(CALL ${find} xxHash REQUIRED)
endmacro()
