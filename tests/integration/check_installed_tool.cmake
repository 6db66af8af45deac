# SPDX-License-Identifier: Apache-2.0
# Installs to a prefix, moves that away, and bakes a textured file there: with the module, and without it.
function(run expected)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0 OR NOT output MATCHES "${expected}")
    message(FATAL_ERROR "failed (${result}), or lacks '${expected}': ${ARGN}\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${work})
run("" ${CMAKE_COMMAND} --install ${build} --prefix ${work}/first)
file(RENAME ${work}/first ${work}/prefix)
set(tool ${work}/prefix/${bindir}/farfield)
unset(ENV{FARFIELD_MODULE_DIR})

file(WRITE ${work}/red.ppm "P3 1 1 255 255 0 0\n")
file(WRITE ${work}/quad.mtl "newmtl red\nmap_Kd red.ppm\n")
file(WRITE ${work}/quad.obj
  "mtllib quad.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl red\nf 1/1 2/2 3/3 4/4\n")
set(bake ${tool} bake ${work}/quad.obj --finest-grid 8)
run("" ${bake} -o ${work}/quad.farfield --report ${work}/quad.json)
file(READ ${work}/quad.json report)
string(JSON warnings LENGTH ${report} warnings)
if(NOT warnings EQUAL 0) # a texture that cannot be read is a warning, and its material plain
  message(FATAL_ERROR "the bake warned:\n${report}")
endif()

if(NOT EXISTS ${work}/prefix/share/bash-completion/completions/farfield)
  message(FATAL_ERROR "bash's completion is not installed")
endif()

# Without it every command that reads no image works, and a textured bake fails rather than bake plain colours.
file(REMOVE ${work}/prefix/${libdir}/farfield/farfield_textures.so)
run("farfield " ${tool} --version)
run("quad.farfield: " ${tool} info ${work}/quad.farfield)
run("" ${tool} verify ${work}/quad.farfield)
execute_process(COMMAND ${bake} -o ${work}/none.farfield RESULT_VARIABLE result ERROR_VARIABLE output)
string(FIND "${output}" "${work}/prefix/${libdir}/farfield/farfield_textures.so" named)
if(NOT result EQUAL 1 OR named EQUAL -1 OR EXISTS ${work}/none.farfield)
  message(FATAL_ERROR "a bake without the module: ${result}\n${output}")
endif()
