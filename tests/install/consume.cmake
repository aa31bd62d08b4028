# cmake -P: installs `buildTree` below `scratch`, then configures, builds and runs `consumer`.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

file(REMOVE_RECURSE ${scratch})
foreach(component library development)
  run(${CMAKE_COMMAND} --install ${buildTree} --component ${component} --prefix ${scratch}/prefix)
endforeach()
# Moved after installing: the package may hold no absolute path to where it was made.
file(RENAME ${scratch}/prefix ${scratch}/moved)

if(sanitize)
  string(APPEND flags " -fsanitize=${sanitize}")
endif()
if(NOT EXISTS ${scratch}/moved/share/doc/esvr/LICENSE)
  message(FATAL_ERROR "the license is not installed")
endif()
# A consumer that calls nothing of CUDA needs none of its packages, however libesvr was built.
run(${CMAKE_COMMAND} -S ${consumer} -B ${scratch}/build -G ${generator}
    -D CMAKE_BUILD_TYPE=Release -D CMAKE_PREFIX_PATH=${scratch}/moved
    -D CMAKE_CXX_COMPILER=${compiler} "-DCMAKE_CXX_FLAGS=${flags}"
    -D CMAKE_DISABLE_FIND_PACKAGE_CUDAToolkit=ON)
run(${CMAKE_COMMAND} --build ${scratch}/build)
run(${scratch}/build/consumer)
set(byCMake "${out}")
if(expectCuda)
  set(expected "active box (-2, 5, 10) to (14, 5, 10), CUDA built in, package says TRUE\n")
else()
  set(expected "active box (-2, 5, 10) to (14, 5, 10), no CUDA, package says FALSE\n")
endif()
if(NOT byCMake STREQUAL expected)
  message(FATAL_ERROR "the consumer printed\n${byCMake}instead of\n${expected}")
endif()

# The same by pkg-config: a C++ program, and a C program on the C interface.
file(GLOB pkgConfigFolder ${scratch}/moved/lib*/pkgconfig ${scratch}/moved/lib*/*/pkgconfig)
set(ENV{PKG_CONFIG_PATH} ${pkgConfigFolder})
run(${pkgConfig} --cflags --libs ${static} esvr)
separate_arguments(linking UNIX_COMMAND "${out}")
separate_arguments(flags UNIX_COMMAND "${flags}")
file(GLOB libraryFolder ${scratch}/moved/lib*/libesvr.* ${scratch}/moved/lib*/*/libesvr.*)
list(GET libraryFolder 0 libraryFolder)
cmake_path(GET libraryFolder PARENT_PATH libraryFolder)
set(ENV{LD_LIBRARY_PATH} ${libraryFolder})
run(${compiler} ${flags} -std=c++20 -DPACKAGE_CUDA="TRUE" ${consumer}/main.cpp -o ${scratch}/by_pc ${linking})
run(${scratch}/by_pc)
if(NOT out MATCHES "^active box \\(-2, 5, 10\\) to \\(14, 5, 10\\)")
  message(FATAL_ERROR "the consumer by pkg-config printed\n${out}")
endif()
if(sanitize)  # clang links a C program without what the library's C++ checks need
  list(APPEND flags -fsanitize-link-c++-runtime)
endif()
run(${cCompiler} ${flags} ${consumer}/main.c -o ${scratch}/c_by_pc ${linking})
run(${scratch}/c_by_pc)
if(NOT out STREQUAL "${version}\n")
  message(FATAL_ERROR "the C program printed\n${out}instead of\n${version}")
endif()
