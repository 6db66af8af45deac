# SPDX-License-Identifier: Apache-2.0
# The parts that can be left out, configured in a folder of their own. What a part alone needs must not be looked for
# without it: those packages are made unfindable, so that looking for one of them as REQUIRED stops the configuration.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

set(bake_packages ZLIB TinyGLTF Imath)
set(tool_packages OpenEXR CLI11)
set(test_packages GTest benchmark)

# configure_with(BAKE TOOLS SAMPLES HIDDEN...): sets `command` to configure these parts, ON or OFF each, without tests and
# benches; HIDDEN packages are not there.
function(configure_with bake tools samples)
  list(TRANSFORM ARGN PREPEND "-DCMAKE_DISABLE_FIND_PACKAGE_" OUTPUT_VARIABLE hidden)
  list(TRANSFORM hidden APPEND "=ON")
  file(REMOVE_RECURSE ${work})
  set(command ${CMAKE_COMMAND} -S ${source} -B ${work} -G ${generator} -D CMAKE_CXX_COMPILER=${compiler}
      -D FARFIELD_BUILD_BAKE=${bake} -D FARFIELD_BUILD_TOOLS=${tools} -D FARFIELD_BUILD_SAMPLES=${samples}
      -D FARFIELD_BUILD_TESTS=OFF -D FARFIELD_BUILD_BENCHES=OFF ${hidden})
  set(command ${command} PARENT_SCOPE)
endfunction()

# What pkg-config finds cannot be hidden.
function(expect_no_oiio)
  file(STRINGS ${work}/CMakeCache.txt oiio REGEX "^oiio_")
  if(oiio)
    message(FATAL_ERROR "OpenImageIO was looked for, without the bake")
  endif()
endfunction()

configure_with(OFF OFF OFF ${bake_packages} ${tool_packages} ${test_packages})
run(${command})
expect_no_oiio()
configure_with(OFF OFF ON ${bake_packages} ${tool_packages} ${test_packages})
run(${command})
configure_with(ON OFF OFF ${tool_packages} ${test_packages})
run(${command})

configure_with(OFF ON OFF)
execute_process(COMMAND ${command} RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE output)
if(result EQUAL 0 OR NOT output MATCHES "FARFIELD_BUILD_TOOLS needs FARFIELD_BUILD_BAKE")
  message(FATAL_ERROR "tools without the bake must be refused by name, but (${result}):\n${output}")
endif()
