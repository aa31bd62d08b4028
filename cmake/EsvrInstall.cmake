# Installs the library, its headers and the package for find_package(esvr). The component `library`
# has everything that another project needs; the component `programs` has the programs.
include(CMakePackageConfigHelpers)

set(packageDir ${CMAKE_INSTALL_LIBDIR}/cmake/esvr)

install(
  TARGETS esvr
  EXPORT esvrTargets
  COMPONENT library)
install(DIRECTORY libesvr/include/esvr TYPE INCLUDE COMPONENT library)
install(
  EXPORT esvrTargets
  NAMESPACE esvr::
  DESTINATION ${packageDir}
  COMPONENT library)

foreach(component library programs)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT ${component})
endforeach()

get_target_property(libraryType esvr TYPE)
string(COMPARE EQUAL ${libraryType} STATIC_LIBRARY ESVR_STATIC)
if(ESVR_WITH_CUDA)
  set(ESVR_CUDA_IN TRUE)
  set(ESVR_CUDART libesvr_cudart_static.a) # CUDA's own may be in the same folder
  if(ESVR_STATIC)
    get_target_property(cudart CUDA::cudart_static IMPORTED_LOCATION)
    file(REAL_PATH ${cudart} cudart) # because a link would be installed as a link
    install(FILES ${cudart} DESTINATION ${CMAKE_INSTALL_LIBDIR} RENAME ${ESVR_CUDART}
            COMPONENT library)
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
  COMPONENT library)

if(TARGET esvr_mpi)
  install(TARGETS esvr_mpi LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT programs)
endif()
set(ESVR_PROGRAMS vdb2esvr esvr2vdb esvr-render esvr-view esvr-compare esvr-sample swc2vdb image2vdb)
foreach(program ${ESVR_PROGRAMS})
  if(TARGET ${program})
    install(TARGETS ${program} COMPONENT programs)
  endif()
endforeach()
