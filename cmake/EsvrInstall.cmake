# Installs the library, its headers, the package for find_package and the file for pkg-config: those of the decoder in a
# build with ESVR_DECODER_ONLY, and those of libesvr in every other.

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

if(ESVR_DECODER_ONLY)
  install(TARGETS esvr_decoder EXPORT esvrDecoderTargets)
  install(FILES libesvr/include/esvr/esvr.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/esvr)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
  install(
    EXPORT esvrDecoderTargets
    NAMESPACE esvr::
    FILE esvrDecoderConfig.cmake
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/esvrDecoder)
  set_target_properties(esvr_decoder PROPERTIES EXPORT_NAME decoder)
  esvr_pkg_config(esvr_decoder esvr_decoder "")
  return()
endif()

# The component `library` has a shared library, `development` has everything else that another
# project needs, `programs` has the programs, `python` has the Python module, and `images` has the programs
# that are written in Python.
include(CMakePackageConfigHelpers)

set(packageDir ${CMAKE_INSTALL_LIBDIR}/cmake/esvr)

install(
  TARGETS esvr
  EXPORT esvrTargets
  ARCHIVE COMPONENT development
  LIBRARY COMPONENT library NAMELINK_COMPONENT development)
set_target_properties(esvr PROPERTIES INSTALL_RPATH "$ORIGIN")
install(DIRECTORY libesvr/include/esvr TYPE INCLUDE COMPONENT development)
install(
  EXPORT esvrTargets
  NAMESPACE esvr::
  DESTINATION ${packageDir}
  COMPONENT development)

if(NOT ESVR_DEB) # a package has its own file of this kind (EsvrPackages.cmake)
  foreach(component library development programs)
    install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT ${component})
  endforeach()
endif()

get_target_property(libraryType esvr TYPE)
string(COMPARE EQUAL ${libraryType} STATIC_LIBRARY ESVR_STATIC)
if(ESVR_WITH_CUDA)
  set(ESVR_CUDA_IN TRUE)
  set(ESVR_CUDART libesvr_cudart_static.a) # CUDA's own may be in the same folder
  if(ESVR_STATIC)
    get_target_property(cudart CUDA::cudart_static IMPORTED_LOCATION)
    file(REAL_PATH ${cudart} cudart) # because a link would be installed as a link
    install(FILES ${cudart} DESTINATION ${CMAKE_INSTALL_LIBDIR} RENAME ${ESVR_CUDART}
            COMPONENT development)
  endif()
else()
  set(ESVR_CUDA_IN FALSE)
endif()
if(ESVR_WITH_ZFP)
  set(ESVR_ZFP_IN TRUE)
else()
  set(ESVR_ZFP_IN FALSE)
endif()
set(ESVR_LIBRARY_DIR ${CMAKE_INSTALL_LIBDIR})
configure_package_config_file(
  cmake/esvrConfig.cmake.in ${PROJECT_BINARY_DIR}/esvrConfig.cmake
  INSTALL_DESTINATION ${packageDir}
  PATH_VARS ESVR_LIBRARY_DIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/esvrConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
file(GLOB findModules CONFIGURE_DEPENDS cmake/Find*.cmake)
install(
  FILES ${PROJECT_BINARY_DIR}/esvrConfig.cmake ${PROJECT_BINARY_DIR}/esvrConfigVersion.cmake
        cmake/EsvrDependencies.cmake ${findModules}
  DESTINATION ${packageDir}
  COMPONENT development)

set(privateLibraries "")
if(ESVR_STATIC)
  set(privateLibraries -lopenvdb -ltbb -lblosc -lz -lxxhash)
  if(OpenVDB_Imath_LIBRARY)
    list(APPEND privateLibraries -lImath)
  endif()
  if(ESVR_WITH_ZFP)
    list(APPEND privateLibraries -lzfp)
  endif()
  if(ESVR_WITH_CUDA)
    list(APPEND privateLibraries -lesvr_cudart_static -lrt)
  endif()
endif()
esvr_pkg_config(esvr esvr "${privateLibraries}")

if(TARGET esvr_mpi)
  install(TARGETS esvr_mpi LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT mpi)
endif()
set(ESVR_PROGRAMS vdb2esvr esvr2vdb esvr-render esvr-view esvr-compare esvr-sample swc2vdb)
set(ESVR_COMPARE_COMMANDS check table)
foreach(program ${ESVR_PROGRAMS})
  if(TARGET ${program})
    install(TARGETS ${program} COMPONENT programs)
  endif()
endforeach()
