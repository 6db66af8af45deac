# SPDX-License-Identifier: Apache-2.0
# The Python package from a prefix of its own: the newcomer's example, then the tests.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work}/example)
run(${CMAKE_COMMAND} --install ${build} --prefix ${work}/prefix)
set(ENV{PYTHONPATH} ${work}/prefix/${package})
set(ENV{PYTHONDONTWRITEBYTECODE} 1)
unset(ENV{FARFIELD_MODULE_DIR})
run(${CMAKE_COMMAND} -E chdir ${work}/example ${python} ${example})
if(NOT EXISTS ${work}/example/ball.farfield/manifest.json)
  message(FATAL_ERROR "the example baked nothing")
endif()
run(${python} -m unittest discover -s ${tests})
