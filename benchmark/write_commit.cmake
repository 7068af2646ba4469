# Writes the commit of the sources to a header, which changes only when the commit does.
#
# usage: cmake -DSOURCE_DIR=DIR -DHEADER=FILE -P write_commit.cmake
#
# It is the last commit that changed what compare_maps is made of, so that figures stay valid when
# documents change; "+changes" says that there are changes in none.
set(sources src include benchmark CMakeLists.txt)
set(commit "")
execute_process(COMMAND git log -1 --format=%h --abbrev=10 -- ${sources}
  WORKING_DIRECTORY ${SOURCE_DIR} OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE
  ERROR_QUIET)
execute_process(COMMAND git status --porcelain -- ${sources}
  WORKING_DIRECTORY ${SOURCE_DIR} OUTPUT_VARIABLE changes ERROR_QUIET)
if(commit STREQUAL "")
  set(commit unknown)
elseif(NOT changes STREQUAL "")
  string(APPEND commit "+changes")
endif()
set(text "#define CUBOID_MAPPING_SOURCE_COMMIT \"${commit}\"\n")
set(old "")
if(EXISTS ${HEADER})
  file(READ ${HEADER} old)
endif()
if(NOT text STREQUAL old)
  file(WRITE ${HEADER} "${text}")
endif()
