# SPDX-License-Identifier: Apache-2.0
# scripts/make_heavy_forest.py: the same files every time, and a scene that is read without a warning. Variables: script,
# tool, work.
include(${CMAKE_CURRENT_LIST_DIR}/run_generator.cmake)
file(REMOVE_RECURSE ${work})
foreach(run first second)
  run_generator(${script} ${work}/${run} --scale 0.002 --instances 200 --variants 1 --only birch,spruce,fern,brig)
endforeach()
file(GLOB files RELATIVE ${work}/first ${work}/first/*)
foreach(file ${files})
  execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${work}/first/${file} ${work}/second/${file} RESULT_VARIABLE differs)
  if(differs)
    message(FATAL_ERROR "${file} is not the same the second time")
  endif()
endforeach()
execute_process(COMMAND ${tool} info ${work}/first/forest.gltf RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE error)
if(NOT result EQUAL 0 OR error OR NOT text MATCHES "birch green")
  message(FATAL_ERROR "farfield info: ${result} ${error} ${text}")
endif()
