# SPDX-License-Identifier: Apache-2.0
# cmake -D tool=FARFIELD -D script=bake_from_blender.py -D module=FOLDER -D work=DIR -P check_bake.cmake: what is selected
# in a .blend file, its packed image too, becomes an asset.
include(${CMAKE_CURRENT_LIST_DIR}/blender.cmake)
if(NOT blender)
  return()
endif()
run_blender(said ${work}/scene.blend --python ${script} --
            -o ${work}/scene.farfield --finest-grid 16 --rays-per-voxel 20 --module ${module})
expect("${said}" "2 meshes in 2 places, 2 materials")
run_and_hear(info ${tool} info --json ${work}/scene.farfield)
string(JSON triangles GET "${info}" levels 0 triangles)
expect("${triangles}" "^4$")
file(READ ${work}/scene.farfield/manifest.json manifest)
string(JSON textures LENGTH "${manifest}" textures)
expect("${textures}" "^1$")
run_and_hear(said ${tool} verify ${work}/scene.farfield)
