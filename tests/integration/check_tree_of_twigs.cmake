# SPDX-License-Identifier: Apache-2.0
# scripts/make_tree_of_twigs.py: its tree is one asset whose level 0 has each twig once, and looks alike from a scene.
# Variables: script, tool, work.
include(${CMAKE_CURRENT_LIST_DIR}/run_generator.cmake)
file(REMOVE_RECURSE ${work})
run_generator(${script} ${work} --scale 0.05 --trees 2)
execute_process(COMMAND ${tool} bake ${work}/oak_of_twigs.gltf --scene --source-only -o ${work}/assets
                RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE error)
if(NOT result EQUAL 0 OR error)
  message(FATAL_ERROR "farfield bake: ${result} ${error} ${text}")
endif()
file(GLOB assets ${work}/assets/*.farfield ${work}/assets/*/*.farfield)
list(LENGTH assets count)
if(NOT count EQUAL 1)
  message(FATAL_ERROR "two equal trees are ${count} assets: ${assets}")
endif()
execute_process(COMMAND ${tool} info ${assets} RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE error)
if(NOT result EQUAL 0 OR error OR NOT text MATCHES "stands in [0-9][0-9][0-9]+ places")
  message(FATAL_ERROR "farfield info: ${result} ${error} ${text}")
endif()
