# cmake -P: installs each component of `buildTree` into a folder of its own, and checks that it has the
# files that its package should have, and that no two components have the same file.
cmake_minimum_required(VERSION 3.22)
set(scratch ${buildTree}/tests/packages/components)
file(REMOVE_RECURSE ${scratch})

# Sets `files` to the paths of a component, relative to the prefix.
function(list_component component)
  execute_process(
    COMMAND ${CMAKE_COMMAND} --install ${buildTree} --component ${component} --prefix
            ${scratch}/${component}
    RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "the component ${component} cannot be installed: ${out}")
  endif()
  file(GLOB_RECURSE found RELATIVE ${scratch}/${component} ${scratch}/${component}/*)
  list(FILTER found EXCLUDE REGEX "^share/doc/")
  list(FILTER found EXCLUDE REGEX "^share/esvr/") # add-ons of other programs, which builds may leave out
  set(files ${found} PARENT_SCOPE)
endfunction()

# Each expression must match a file of the component, and each file must match an expression.
function(check component)
  list_component(${component})
  set(rest ${files})
  foreach(expression ${ARGN})
    set(matching ${files})
    list(FILTER matching INCLUDE REGEX "^${expression}$")
    list(LENGTH matching count)
    if(count EQUAL 0)
      message(SEND_ERROR "${component} has no file ${expression}")
    endif()
    list(FILTER rest EXCLUDE REGEX "^${expression}$")
  endforeach()
  if(rest)
    message(SEND_ERROR "${component} has files that no rule names: ${rest}")
  endif()
  foreach(file ${files})
    if(file IN_LIST all)
      message(SEND_ERROR "${file} is in two components")
    endif()
  endforeach()
  set(all ${all} ${files} PARENT_SCOPE)
endfunction()

set(library "lib(/[^/]+)?")
list(TRANSFORM programs PREPEND "bin/" OUTPUT_VARIABLE binaries)
list(TRANSFORM programs REPLACE "(.+)" "share/man/man1/\\1[.]1(.gz)?" OUTPUT_VARIABLE pages)
list(TRANSFORM completed PREPEND "share/bash-completion/completions/" OUTPUT_VARIABLE completions)

set(all)
check(development "include/esvr/[a-z_]+[.]h" "${library}/cmake/esvr/[A-Za-z-]+[.]cmake"
      "${library}/pkgconfig/esvr[.]pc" "${library}/libesvr(_cudart_static)?[.](a|so)")
check(programs ${binaries} ${pages} ${completions} "share/bash-completion/completions/esvr"
      "share/man/man1/esvr-compare-[a-z]+[.]1(.gz)?" "share/man/man5/esvr[.]5(.gz)?"
      "share/zsh/(site-functions|vendor-completions)/_esvr")
if(withPython)
  check(python "lib/python3/dist-packages/esvr/([a-z_]+[.]py|_core[.]pyi|py[.]typed)"
        "lib/python3/dist-packages/esvr/_core[.][a-z0-9_-]+[.]so"
        "lib/python3/dist-packages/esvr/images/[a-z0-9_]+[.]py")
  check(images "bin/(image2vdb|vdb2image)" "share/man/man1/(image2vdb|vdb2image)[.]1(.gz)?")
endif()
