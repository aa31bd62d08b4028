# What man and the shells know of the programs, which are ESVR_PROGRAMS (EsvrInstall.cmake) and ESVR_PYTHON_PROGRAMS
# (integrations/python).

# Their man pages are made from their own --help, and that of the format, esvr(5), from docs/format.md. Packages have
# compressed pages.
set(manPages)

# esvr_man_file(<page> [COMPONENT <component>] COMMAND <command>... DEPENDS <files>...) makes a page in the
# folder of its section by a command that prints it.
function(esvr_man_file page)
  cmake_parse_arguments(PARSE_ARGV 1 man "" "COMPONENT" "COMMAND;DEPENDS")
  if(NOT man_COMPONENT)
    set(man_COMPONENT programs)
  endif()
  string(REGEX MATCH "[0-9]$" section ${page})
  set(folder ${PROJECT_BINARY_DIR}/man/man${section})
  file(MAKE_DIRECTORY ${folder})
  set(file ${folder}/${page})
  add_custom_command(OUTPUT ${file} COMMAND ${man_COMMAND} > ${file} DEPENDS ${man_DEPENDS} VERBATIM)
  if(ESVR_DEB)
    add_custom_command(OUTPUT ${file}.gz COMMAND gzip -9nkf ${file} DEPENDS ${file} VERBATIM)
    string(APPEND file .gz)
  endif()
  set(manPages ${manPages} ${file} PARENT_SCOPE)
  install(FILES ${file} DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section} COMPONENT ${man_COMPONENT})
endfunction()

function(esvr_man_page page program)
  if(TARGET ${program} AND NOT CMAKE_CROSSCOMPILING)
    esvr_man_file(${page}.1 COMMAND $<TARGET_FILE:${program}> ${ARGN} --help man DEPENDS ${program})
    set(manPages ${manPages} PARENT_SCOPE)
  endif()
endfunction()

foreach(program ${ESVR_PROGRAMS})
  esvr_man_page(${program} ${program})
endforeach()
foreach(command ${ESVR_COMPARE_COMMANDS})
  esvr_man_page(esvr-compare-${command} esvr-compare ${command})
endforeach()

if(ESVR_PYTHON_PROGRAMS AND NOT CMAKE_CROSSCOMPILING)
  execute_process(COMMAND ${Python_EXECUTABLE} -c "import numpy" RESULT_VARIABLE noNumpy
                  OUTPUT_QUIET ERROR_QUIET)
  if(noNumpy)
    message(STATUS "NumPy was not found, so that image2vdb and vdb2image have no man pages")
  else()
    file(GLOB programFiles CONFIGURE_DEPENDS integrations/python/esvr/images/*.py)
    foreach(program ${ESVR_PYTHON_PROGRAMS})
      # -B: no compiled files in the build folder, which an installation would not have
      esvr_man_file(${program}.1 COMPONENT images
                    COMMAND ${Python_EXECUTABLE} -B ${PROJECT_BINARY_DIR}/python/${program} --help man
                    DEPENDS esvr_python ${programFiles})
    endforeach()
  endif()
endif()

find_program(ESVR_LOWDOWN lowdown)
mark_as_advanced(ESVR_LOWDOWN)
if(ESVR_LOWDOWN AND manPages)
  set(maker ${PROJECT_SOURCE_DIR}/cmake/format_page.sh)
  set(format ${PROJECT_SOURCE_DIR}/docs/format.md)
  esvr_man_file(esvr.5 COMMAND ${maker} ${PROJECT_VERSION} ${format} ${manPages}
                DEPENDS ${maker} ${format} ${manPages})
elseif(manPages)
  message(STATUS "lowdown was not found, so that there is no man page of the format")
endif()
if(manPages)
  add_custom_target(man ALL DEPENDS ${manPages})
endif()

# They are completed in bash and in zsh. bash loads the file that has the name of a program,
# so that the file is installed with a link for each.
set(completed ${ESVR_PROGRAMS} ${ESVR_PYTHON_PROGRAMS})
list(JOIN completed " " ESVR_PROGRAM_NAMES)
list(JOIN ESVR_COMPARE_COMMANDS " " ESVR_COMPARE_COMMAND_NAMES)
set(completionFolder ${PROJECT_BINARY_DIR}/completion)
file(MAKE_DIRECTORY ${completionFolder}/bash)
configure_file(integrations/completion/esvr.bash.in ${completionFolder}/bash/esvr @ONLY)
configure_file(integrations/completion/_esvr.in ${completionFolder}/_esvr @ONLY)
foreach(program ${completed})
  file(CREATE_LINK esvr ${completionFolder}/bash/${program} SYMBOLIC)
endforeach()

# Debian keeps the folder site-functions for what is not from a package.
set(zshFolder site-functions)
if(ESVR_DEB)
  set(zshFolder vendor-completions)
endif()
install(DIRECTORY ${completionFolder}/bash/ COMPONENT programs
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${completionFolder}/_esvr COMPONENT programs
        DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/${zshFolder})
