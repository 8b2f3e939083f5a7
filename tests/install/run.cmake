# Installs the build into a directory of its own, then builds and runs the consumer against it.
#   cmake -DBUILD_DIR=... -DSOURCE_DIR=... -DWORK_DIR=... -DGENERATOR=... -DCOMPILER=... -P run.cmake
cmake_minimum_required(VERSION 3.22)

function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/prefix)
foreach(file man/man1/graphmatch_matcher.1.gz bash-completion/completions/graphmatch_matcher
        zsh/site-functions/_graphmatch_matcher doc/colmap-graphmatch/README.md doc/colmap-graphmatch/copyright
        doc/colmap-graphmatch/docs/install.md)
  if(NOT EXISTS ${WORK_DIR}/prefix/share/${file})
    message(FATAL_ERROR "share/${file} was not installed")
  endif()
endforeach()

# The installed headers are those that colmap_graphmatch.h leads to, and each compiles alone.
set(include ${WORK_DIR}/prefix/include)
set(reached colmap_graphmatch/colmap_graphmatch.h)
set(unread ${reached})
while(unread)
  list(POP_FRONT unread header)
  if(NOT EXISTS ${include}/${header})
    message(FATAL_ERROR "${header} is included and was not installed")
  endif()
  file(STRINGS ${include}/${header} lines REGEX "^#include \"")
  foreach(line ${lines})
    string(REGEX REPLACE "^#include \"(.*)\"$" "\\1" other ${line})
    if(NOT other IN_LIST reached)
      list(APPEND reached ${other})
      list(APPEND unread ${other})
    endif()
  endforeach()
endwhile()
file(GLOB_RECURSE headers RELATIVE ${include} ${include}/*)
foreach(header ${headers})
  if(NOT header IN_LIST reached)
    message(FATAL_ERROR "${header} was installed, and colmap_graphmatch.h does not lead to it")
  endif()
  run(${COMPILER} -std=c++17 -Wall -Wextra -Werror -fsyntax-only -I ${include} -include ${header} -x c++ /dev/null)
endforeach()

# Any program will do for COLMAP here.
run(${CMAKE_COMMAND} -E env GRAPHMATCH_COLMAP=true
    ${WORK_DIR}/prefix/libexec/colmap-graphmatch/colmap vocab_tree_matcher --version)
run(${CMAKE_COMMAND} -S ${SOURCE_DIR} -B ${WORK_DIR}/consumer -G ${GENERATOR}
    -DCMAKE_PREFIX_PATH=${WORK_DIR}/prefix -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${WORK_DIR}/consumer)
run(${WORK_DIR}/consumer/consumer)
run(${WORK_DIR}/prefix/bin/graphmatch_matcher --version)

# The program without the libraries, and the libraries without the program.
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/runtime --component runtime)
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/development --component development)
if(EXISTS ${WORK_DIR}/runtime/include OR NOT EXISTS ${WORK_DIR}/runtime/bin/graphmatch_matcher
   OR EXISTS ${WORK_DIR}/development/bin OR EXISTS ${WORK_DIR}/development/share)
  message(FATAL_ERROR "the components are mixed up")
endif()
