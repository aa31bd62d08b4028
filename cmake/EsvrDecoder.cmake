# The build with ESVR_DECODER_ONLY: the decoder, its installation and its test. CMake is not asked for
# any package.
add_subdirectory(libesvr/decoder)

install(TARGETS esvr_decoder EXPORT esvrDecoderTargets)
install(FILES libesvr/include/esvr/esvr.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/esvr)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(
  EXPORT esvrDecoderTargets
  NAMESPACE esvr::
  FILE esvrDecoderConfig.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/esvrDecoder)
set_target_properties(esvr_decoder PROPERTIES EXPORT_NAME decoder)
include(EsvrPkgConfig)
esvr_pkg_config(esvr_decoder esvr_decoder "")

if(EMSCRIPTEN)
  add_subdirectory(libesvr/page)
elseif(ESVR_BUILD_TESTS)
  enable_testing()
  add_subdirectory(tests/capi)
endif()
