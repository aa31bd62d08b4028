# Makes the man pages of ESVR_PROGRAMS (EsvrInstall.cmake) from their own --help, and that of the
# format, esvr(5), from docs/format.md. Packages have compressed pages.
set(manPages)

# esvr_man_file(<page> COMMAND <command>... DEPENDS <files>...) makes a page in the folder of its
# section by a command that prints it.
function(esvr_man_file page)
  cmake_parse_arguments(PARSE_ARGV 1 man "" "" "COMMAND;DEPENDS")
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
  install(FILES ${file} DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section} COMPONENT programs)
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
