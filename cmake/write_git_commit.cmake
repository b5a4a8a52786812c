# SPDX-License-Identifier: BSD-3-Clause
# Writes OUTPUT, a header with the commit of the sources; run at every build, touches the file only when it changes.
# cmake -DGIT=… -DSOURCE=… -DTEMPLATE=… -DOUTPUT=… -P write_git_commit.cmake
set(CAROM_GIT_COMMIT "unknown")
if(GIT)
  execute_process(COMMAND ${GIT} -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude=*
                  OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(failed EQUAL 0 AND described)
    set(CAROM_GIT_COMMIT ${described})
  endif()
endif()
configure_file(${TEMPLATE} ${OUTPUT} @ONLY)
