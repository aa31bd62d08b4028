# cmake -P: installs `buildTree` below `scratch`, then configures, builds and runs `consumer`.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\n${out}")
  endif()
  set(out "${out}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${scratch})
run(${CMAKE_COMMAND} --install ${buildTree} --component library --prefix ${scratch}/prefix)
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

if(expectCuda)
  set(expected "active box (-2, 5, 10) to (14, 5, 10), CUDA built in, package says TRUE\n")
else()
  set(expected "active box (-2, 5, 10) to (14, 5, 10), no CUDA, package says FALSE\n")
endif()
if(NOT out STREQUAL expected)
  message(FATAL_ERROR "the consumer printed\n${out}instead of\n${expected}")
endif()
