# SPDX-License-Identifier: Apache-2.0
# cmake -D tool=FARFIELD -D work=DIR -P check_mattes.cmake: Blender's Cryptomatte node finds in our picture, by their
# names, the objects and materials of a scene that Blender exported; each fills one half of it.
include(${CMAKE_CURRENT_LIST_DIR}/blender.cmake)
if(NOT blender)
  return()
endif()
run_and_hear(said ${tool} render ${work}/scene.glb --cryptomatte --full-detail --size 32x16 --spp 4 -o ${work}/picture.exr)
run_blender(objects --python ${here}/pick_mattes.py -- ${work}/picture.exr CryptoObject Left Right Elsewhere)
expect("${objects}" "Left left 1.000 right 0.000")
expect("${objects}" "Right left 0.000 right 1.000")
expect("${objects}" "Elsewhere left 0.000 right 0.000")
run_blender(materials --python ${here}/pick_mattes.py -- ${work}/picture.exr CryptoMaterial red painted)
expect("${materials}" "red left 1.000 right 0.000")
expect("${materials}" "painted left 0.000 right 1.000")
