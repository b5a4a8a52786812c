# Writes the commit of the source tree into a header, which changes only when the commit does. Run at every build:
#   cmake -DSOURCE=… -DHEADER=… -P git_commit.cmake
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=10 --exclude=*
                OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT commit)
  set(commit unknown)
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#define CAROM_GIT_COMMIT \"@commit@\"\n" @ONLY)
