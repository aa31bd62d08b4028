# esvr_pkg_config(<name> <target> <private libraries>) makes and installs <name>.pc, with which a
# program links the target. `pkg-config --static` adds the private libraries, which a static library
# needs, and those of C++, because the program may be written in C.
function(esvr_pkg_config name target privateLibraries)
  get_target_property(type ${target} TYPE)
  set(ESVR_PC_PRIVATE "")
  if(type STREQUAL STATIC_LIBRARY)
    set(ESVR_PC_PRIVATE ${privateLibraries} -lstdc++ -lm -pthread ${CMAKE_DL_LIBS})
    list(TRANSFORM ESVR_PC_PRIVATE REPLACE "^([a-z]+)$" "-l\\1") # CMAKE_DL_LIBS names libraries
    list(JOIN ESVR_PC_PRIVATE " " ESVR_PC_PRIVATE)
  endif()
  set(ESVR_PC_NAME ${name})
  set(ESVR_PC_LIBRARY ${target})
  if(ESVR_DEB)
    set(ESVR_PC_PREFIX ${CMAKE_INSTALL_PREFIX})
  else() # relative, so that an installation can be moved
    file(RELATIVE_PATH ESVR_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
    string(REGEX REPLACE "/$" "" ESVR_PC_PREFIX "\${pcfiledir}/${ESVR_PC_PREFIX}")
  endif()
  set(file ${PROJECT_BINARY_DIR}/${name}.pc)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/esvr.pc.in ${file} @ONLY)
  install(FILES ${file} DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endfunction()
