# Makes the man pages of ESVR_PROGRAMS (EsvrInstall.cmake) from their own --help.
set(manPages)
function(esvr_man_page page program)
  if(NOT TARGET ${program})
    return()
  endif()
  set(file ${PROJECT_BINARY_DIR}/man/man1/${page}.1)
  add_custom_command(
    OUTPUT ${file}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${PROJECT_BINARY_DIR}/man/man1
    COMMAND $<TARGET_FILE:${program}> ${ARGN} --help man > ${file}
    DEPENDS ${program}
    VERBATIM)
  set(manPages ${manPages} ${file} PARENT_SCOPE)
endfunction()

foreach(program ${ESVR_PROGRAMS})
  esvr_man_page(${program} ${program})
endforeach()
foreach(command check table curves stability)
  esvr_man_page(esvr-compare-${command} esvr-compare ${command})
endforeach()

if(manPages AND NOT CMAKE_CROSSCOMPILING)
  add_custom_target(man ALL DEPENDS ${manPages})
  install(FILES ${manPages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT programs)
  install(FILES integrations/completion/esvr.bash RENAME esvr COMPONENT programs
          DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
endif()
