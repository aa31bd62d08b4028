# The target check_headers compiles every public header on its own, included twice in one file.
# Headers with device code (ESVR_HD) are compiled by nvcc too.
file(GLOB_RECURSE publicHeaders CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}/libesvr/include
     libesvr/include/esvr/*.h)

function(esvr_alone header extension outSources)
  string(MAKE_C_IDENTIFIER ${header} name)
  set(source ${PROJECT_BINARY_DIR}/check_headers/${name}.${extension})
  file(CONFIGURE OUTPUT ${source} CONTENT "#include \"@header@\"\n#include \"@header@\"\n" @ONLY)
  set(${outSources} ${${outSources}} ${source} PARENT_SCOPE)
endfunction()

set(sources "")
foreach(header ${publicHeaders})
  esvr_alone(${header} cpp sources)
  file(STRINGS libesvr/include/${header} deviceCode REGEX "ESVR_HD ")
  if(ESVR_WITH_CUDA AND deviceCode)
    esvr_alone(${header} cu sources)
  endif()
endforeach()

add_library(check_headers OBJECT EXCLUDE_FROM_ALL ${sources})
set_target_properties(check_headers PROPERTIES UNITY_BUILD OFF)
target_compile_features(check_headers PRIVATE cxx_std_20)
target_include_directories(check_headers PRIVATE libesvr/include)
