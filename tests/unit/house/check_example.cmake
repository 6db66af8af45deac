# SPDX-License-Identifier: Apache-2.0
# cmake -D from=FILE -D headers=DIRS -D compiler=CXX -D work=DIR -P check_example.cmake: compiles the C++ examples in
# FILE, a Markdown document (all its ```cpp blocks) or a header (the indented lines of its first comment), as a host
# would: each as the body of a function, after example_setting.h.
file(READ ${from} text)
set(functions "")
set(count 0)

function(add_example code)
  string(REGEX REPLACE "(^|\n)#include [^\n]*" "\n" code "${code}") # those are in the setting
  math(EXPR number "${count} + 1")
  set(count ${number} PARENT_SCOPE)
  set(functions "${functions}void example_${number}() {\n${code}\n}\n\n" PARENT_SCOPE)
endfunction()

if(from MATCHES "\\.md$")
  string(FIND "${text}" "```cpp\n" begin)
  while(NOT begin EQUAL -1)
    math(EXPR begin "${begin} + 7")
    string(SUBSTRING "${text}" ${begin} -1 text)
    string(FIND "${text}" "```" length)
    string(SUBSTRING "${text}" 0 ${length} code)
    add_example("${code}")
    math(EXPR rest "${length} + 3")
    string(SUBSTRING "${text}" ${rest} -1 text)
    string(FIND "${text}" "```cpp\n" begin)
  endwhile()
  if(count EQUAL 0)
    message(FATAL_ERROR "${from} has no ```cpp block")
  endif()
else()
  string(FIND "${text}" "#pragma once" end)
  string(SUBSTRING "${text}" 0 ${end} code)
  if(NOT code MATCHES "\n//   [^\n]+;\n")
    message(FATAL_ERROR "${from} has no example: no indented lines of code in the comment before #pragma once")
  endif()
  string(REPLACE "\n//   " "\n" code "${code}") # its prose stays a comment
  add_example("${code}")
endif()

get_filename_component(name ${from} NAME_WE)
set(source ${work}/${name}_example.cpp)
file(WRITE ${source} "#include \"${CMAKE_CURRENT_LIST_DIR}/example_setting.h\"\n\n${functions}")
set(includes)
foreach(folder IN LISTS headers)
  if(NOT folder STREQUAL "/usr/include") # the compiler looks there anyway, and in its own order
    list(APPEND includes -I${folder})
  endif()
endforeach()
# Examples name things that they do not go on to use.
execute_process(COMMAND ${compiler} -std=c++17 -Wpedantic -Wall -Wextra -Werror
                        -Wno-unused-variable -Wno-unused-but-set-variable -fsyntax-only ${includes} ${source}
                RESULT_VARIABLE result ERROR_VARIABLE errors)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "the examples in ${from} do not compile (as ${source}):\n${errors}")
endif()
