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

# A host that builds without CMake, from a prefix that was moved.
file(RENAME ${work}/prefix ${work}/moved)
set(ENV{PKG_CONFIG_PATH} ${work}/moved/${libdir}/pkgconfig)
execute_process(COMMAND pkg-config --cflags --libs farfield RESULT_VARIABLE result OUTPUT_VARIABLE flags ERROR_VARIABLE flags)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "pkg-config does not find farfield:\n${flags}")
endif()
separate_arguments(flags UNIX_COMMAND "${flags}")
run(${compiler} -std=c++17 -Werror ${work}/moved/${docdir}/samples/minimal_host/main.cpp -o ${work}/by_pkg_config ${flags}
    -Wl,-rpath,${work}/moved/${libdir})
run(${work}/by_pkg_config ${asset} ${work}/by_pkg_config.ppm)
file(RENAME ${work}/moved ${work}/prefix)

foreach(file LICENSE licenses.md)
  if(NOT EXISTS ${work}/prefix/${docdir}/${file})
    message(FATAL_ERROR "not installed: ${docdir}/${file}")
  endif()
endforeach()
# Nothing but the public headers is installed, and they include nothing that is not.
file(GLOB_RECURSE headers RELATIVE ${work}/prefix/include ${work}/prefix/include/*)
foreach(header ${headers})
  if(NOT header MATCHES "^farfield/[a-z_]+\\.h$")
    message(FATAL_ERROR "installed, but not a public header: ${header}")
  endif()
endforeach()
