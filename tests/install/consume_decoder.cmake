# cmake -P: installs the decoder of `buildTree` below `scratch`, and builds and runs `program`, which
# is written in C, with what pkg-config says of it.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

file(REMOVE_RECURSE ${scratch})
run(${CMAKE_COMMAND} --install ${buildTree} --prefix ${scratch}/prefix)
# Moved after installing: the installation may hold no absolute path to where it was made.
file(RENAME ${scratch}/prefix ${scratch}/moved)
file(GLOB_RECURSE pc ${scratch}/moved/*/esvr_decoder.pc)
cmake_path(GET pc PARENT_PATH folder)
set(ENV{PKG_CONFIG_PATH} ${folder})
cmake_path(GET folder PARENT_PATH libraries)
set(ENV{LD_LIBRARY_PATH} ${libraries}) # of a shared library
run(${pkgConfig} --cflags --libs ${static} esvr_decoder)
separate_arguments(linking UNIX_COMMAND "${out}")
run(${compiler} ${program} -o ${scratch}/program ${linking})
run(${scratch}/program)
if(NOT out STREQUAL "${version}\n")
  message(FATAL_ERROR "the program printed\n${out}instead of\n${version}")
endif()
