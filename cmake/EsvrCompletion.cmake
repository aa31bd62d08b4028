# Completion of all programs in bash and in zsh. bash loads the file that has the name of a program,
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
