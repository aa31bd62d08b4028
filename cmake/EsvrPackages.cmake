# Packages for Debian and Ubuntu, one for each component of the installation (docs/library.md). The
# preset `deb` sets ESVR_DEB, and `cpack` in its build folder makes the packages.
if(NOT ESVR_DEB)
  return()
endif()
if(NOT BUILD_SHARED_LIBS)
  message(FATAL_ERROR "ESVR_DEB needs BUILD_SHARED_LIBS, because libesvr0 is a shared library")
endif()
find_program(ESVR_GZIP gzip REQUIRED)

# The revision names the distribution, because packages of one cannot be used on another.
file(STRINGS /etc/os-release osRelease)
foreach(line ${osRelease})
  if(line MATCHES "^(ID|VERSION_ID|VERSION_CODENAME)=\"?([^\"]*)\"?$")
    set(os_${CMAKE_MATCH_1} ${CMAKE_MATCH_2})
  endif()
endforeach()
set(CPACK_DEBIAN_PACKAGE_RELEASE "1~${os_ID}${os_VERSION_ID}")

# The maintainer is named as for Debian's own tools.
set(ESVR_MAINTAINER "ESVR maintainers <maintainers@esvr.example.org>")
if(DEFINED ENV{DEBEMAIL} AND DEFINED ENV{DEBFULLNAME})
  set(ESVR_MAINTAINER "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "${ESVR_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # each package has its own
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/libesvr) # for libesvr itself
set(CPACK_DEBIAN_PACKAGE_SOURCE esvr)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

# esvr_package(<component> <package> <section> <description>) makes a package of a component, with
# the files that every package has in /usr/share/doc. The first line of the description is the summary.
set(CPACK_COMPONENTS_ALL)
function(esvr_package component package section description)
  string(TOUPPER ${component} COMPONENT)
  foreach(setting "PACKAGE_NAME;${package}" "PACKAGE_SECTION;${section}" "FILE_NAME;DEB-DEFAULT"
                  "DESCRIPTION;${description}")
    list(POP_FRONT setting name)
    set(CPACK_DEBIAN_${COMPONENT}_${name} "${setting}" PARENT_SCOPE)
  endforeach()
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
  install(
    FILES ${debianFolder}/changelog.Debian.gz ${debianFolder}/changelog.gz
          ${PROJECT_SOURCE_DIR}/cmake/debian/copyright
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package}
    COMPONENT ${component})
endfunction()

# The time is that of SOURCE_DATE_EPOCH if it is set, so that a build can be repeated.
set(debianFolder ${PROJECT_BINARY_DIR}/debian)
string(TIMESTAMP packageDate "%a, %d %b %Y %H:%M:%S +0000" UTC)
configure_file(cmake/debian/changelog.in ${debianFolder}/changelog.Debian @ONLY)
configure_file(CHANGELOG.md ${debianFolder}/changelog COPYONLY)
foreach(name changelog.Debian changelog)
  execute_process(COMMAND ${ESVR_GZIP} -9nkf ${debianFolder}/${name} COMMAND_ERROR_IS_FATAL ANY)
endforeach()

set(about
    "ESVR replaces the voxels of an OpenVDB or NanoVDB grid by a short list of
ellipsoids whose sum approximates the grid. The ellipsoids can be drawn
directly, and they can be converted back to a VDB grid. Names, transforms
and metadata of grids are kept.

")
esvr_package(library libesvr0 libs "sparse volumes as ellipsoids - shared library
${about}This package has the shared library. It uses a GPU where a driver of
CUDA is installed, and needs none.")
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/triggers)

esvr_package(development libesvr-dev libdevel "sparse volumes as ellipsoids - development files
${about}This package has the headers for C++ and C, and the files for CMake and
pkg-config.")
set(CPACK_COMPONENT_DEVELOPMENT_DEPENDS library)

esvr_package(programs esvr-tools graphics "sparse volumes as ellipsoids - programs
${about}This package has the programs, which convert, draw, show and compare
files, and a plugin for ParaView.")
set(CPACK_COMPONENT_PROGRAMS_DEPENDS library)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS "ffmpeg")
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SUGGESTS "paraview, python3-esvr, esvr-images")
install(FILES integrations/paraview/esvr_reader.py COMPONENT programs
        DESTINATION ${CMAKE_INSTALL_DATADIR}/esvr/paraview)
install(DIRECTORY integrations/paraview/debian12 COMPONENT programs
        DESTINATION ${CMAKE_INSTALL_DATADIR}/esvr/paraview)

if(ESVR_WITH_PYTHON)
  esvr_package(python python3-esvr python "sparse volumes as ellipsoids - Python module
${about}This package has the Python module esvr, which reads, writes, fits, draws
and compares volumes as arrays of NumPy.")
  set(CPACK_COMPONENT_PYTHON_DEPENDS library)
  math(EXPR pythonNext "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= 3.${Python_VERSION_MINOR}), python3 (<< 3.${pythonNext}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/python/postinst
                                                ${PROJECT_SOURCE_DIR}/cmake/debian/python/prerm)

  esvr_package(images esvr-images graphics "sparse volumes as ellipsoids - images in and out
${about}This package has image2vdb and vdb2image, which convert images of
microscopes, scanners and simulations to grids and back. Each format is read
by the package of Debian that knows it.")
  set(CPACK_COMPONENT_IMAGES_DEPENDS python)
  # Packages that bring several hundred megabytes are suggested only.
  set(CPACK_DEBIAN_IMAGES_PACKAGE_RECOMMENDS
      "python3-tifffile, python3-nibabel, python3-mrcfile, python3-pydicom, python3-h5py, python3-netcdf4, python3-zarr")
  set(CPACK_DEBIAN_IMAGES_PACKAGE_SUGGESTS
      "esvr-tools, python3-gdal, python3-gdcm, python3-vtk9 | python3-paraview")
endif()

if(TARGET esvr_mpi)
  esvr_package(mpi esvr-mpi graphics "sparse volumes as ellipsoids - fits on several hosts
${about}This package has a module that the programs load where MPI has started
them, so that they need no MPI themselves.")
  set(CPACK_COMPONENT_MPI_DEPENDS library)
  set(CPACK_DEBIAN_MPI_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/triggers)
endif()

include(CPack)
