# SPDX-License-Identifier: Apache-2.0
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

function(build_against_package project folder)
  run(${CMAKE_COMMAND} -S ${project} -B ${folder} -G ${generator} -D CMAKE_CXX_COMPILER=${compiler}
      -D CMAKE_BUILD_TYPE=Release -D CMAKE_PREFIX_PATH=${work}/prefix -D CMAKE_COMPILE_WARNING_AS_ERROR=ON)
  run(${CMAKE_COMMAND} --build ${folder})
endfunction()

file(REMOVE_RECURSE ${work})
run(${CMAKE_COMMAND} --install ${build} --prefix ${work}/prefix)
build_against_package(${source} ${work}/headers)

# The samples as they are installed, on the small asset.
build_against_package(${work}/prefix/${docdir}/samples ${work}/samples)
run(${work}/samples/minimal_host ${asset} ${work}/minimal_host.ppm)
run(${work}/samples/pull_back ${asset} ${work}/frames 2)
run(${work}/samples/memory_stress ${asset})
if(with_bake)
  run(${work}/samples/bake_from_memory ${work}/bush.farfield ${work}/bush.ppm)
endif()

if(NOT EXISTS ${work}/prefix/${docdir}/LICENSE)
  message(FATAL_ERROR "the licence is not installed")
endif()
# Nothing but the public headers is installed, and they include nothing that is not.
file(GLOB_RECURSE headers RELATIVE ${work}/prefix/include ${work}/prefix/include/*)
foreach(header ${headers})
  if(NOT header MATCHES "^farfield/[a-z_]+\\.h$")
    message(FATAL_ERROR "installed, but not a public header: ${header}")
  endif()
endforeach()
