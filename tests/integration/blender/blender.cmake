# SPDX-License-Identifier: Apache-2.0
# What the checks against Blender share. Blender is no package of Farfield's: without it they skip.
find_program(blender blender)
if(NOT blender)
  message("skipped: there is no blender")
  return()
endif()
set(here ${CMAKE_CURRENT_LIST_DIR})

# run_and_hear(OUT COMMAND...): what the command says; it must succeed.
function(run_and_hear out)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE said ERROR_VARIABLE said)
  if(NOT result EQUAL 0)
    string(REPLACE ";" " " command "${ARGN}")
    message(FATAL_ERROR "${command} ended with ${result}:\n${said}")
  endif()
  set(${out} "${said}" PARENT_SCOPE)
endfunction()

# run_blender(OUT ARGUMENTS...): without a display, and an error of its Python is one of Blender.
function(run_blender out)
  run_and_hear(said ${blender} -b --factory-startup --python-exit-code 3 ${ARGN})
  set(${out} "${said}" PARENT_SCOPE)
endfunction()

function(expect text pattern)
  if(NOT text MATCHES "${pattern}")
    message(FATAL_ERROR "\"${pattern}\" is not in:\n${text}")
  endif()
endfunction()

file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work})
run_blender(said --python ${here}/make_scene.py -- ${work})
