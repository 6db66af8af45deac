# SPDX-License-Identifier: Apache-2.0
# cmake -D from=FILE -D headers=DIRS -D compiler=CXX -D work=DIR -P check_example.cmake: compiles the C++ example in
# FILE, a Markdown document (its ```cpp block) or a header (the indented lines of its first comment), as a host would.
file(READ ${from} text)
if(from MATCHES "\\.md$")
  if(NOT text MATCHES "```cpp\n#include <farfield/runtime.h>\n([^`]+)```")
    message(FATAL_ERROR "${from} has no ```cpp block that starts with #include <farfield/runtime.h>")
  endif()
  set(example "${CMAKE_MATCH_1}")
else()
  string(FIND "${text}" "#pragma once" end)
  string(SUBSTRING "${text}" 0 ${end} example)
  if(NOT example MATCHES "\n//   [^\n]+;\n")
    message(FATAL_ERROR "${from} has no example: no indented lines of code in the comment before #pragma once")
  endif()
  string(REPLACE "\n//   " "\n" example "${example}") # its prose stays a comment
endif()

# What a host has before it meets Farfield.
get_filename_component(name ${from} NAME_WE)
set(source ${work}/${name}_example.cpp)
file(WRITE ${source} "#include <farfield/runtime.h>
void example(RTCDevice device, RTCScene scene, RTCRayHit ray_hit, const std::vector<glm::mat4x3>& places,
             glm::mat4x3 local_to_world, glm::vec3 eye, float pixel_spread, uint32_t path, uint32_t ray,
             farfield::Rng rng, glm::vec3 throughput);
void example(RTCDevice device, RTCScene scene, RTCRayHit ray_hit,
             [[maybe_unused]] const std::vector<glm::mat4x3>& places, [[maybe_unused]] glm::mat4x3 local_to_world,
             glm::vec3 eye, float pixel_spread, [[maybe_unused]] uint32_t path, [[maybe_unused]] uint32_t ray,
             farfield::Rng rng, glm::vec3 throughput) {
${example}
}
")
set(includes)
foreach(folder IN LISTS headers)
  if(NOT folder STREQUAL "/usr/include") # the compiler looks there anyway, and in its own order
    list(APPEND includes -I${folder})
  endif()
endforeach()
execute_process(COMMAND ${compiler} -std=c++17 -Wpedantic -Wall -Wextra -Werror -fsyntax-only ${includes} ${source}
                RESULT_VARIABLE result ERROR_VARIABLE errors)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "the example in ${from} does not compile (as ${source}):\n${errors}")
endif()
