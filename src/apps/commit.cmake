# Writes which commit is built, at each build, and only where that is another one: cmake -DROOT=... -DHEADER=... -P
find_program(GIT git)
set(commit "unknown")
if(GIT AND EXISTS ${ROOT}/.git)
  execute_process(COMMAND ${GIT} -C ${ROOT} describe --always --abbrev=12 --dirty --exclude=*
    OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed)
    set(commit "${described}")
  endif()
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#pragma once\n\nconstexpr const char* kCommit = \"@commit@\";\n" @ONLY)
