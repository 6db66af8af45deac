# SPDX-License-Identifier: Apache-2.0
# One way to declare a room, a test and a bench, so that every target has the same warnings and language level.

# farfield_configure(TARGET [STANDARD]): our own files are C++20; STANDARD (cxx_std_20) is what its users need.
function(farfield_configure target)
  set(standard cxx_std_20)
  if(ARGC GREATER 1)
    set(standard ${ARGV1})
  endif()
  target_compile_features(${target} PRIVATE cxx_std_20 INTERFACE ${standard})
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON
                        CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion
                         $<$<BOOL:${FARFIELD_WERROR}>:-Werror>)
  if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage) # gcc takes what is not the main file for a header
  endif()
  # No routine of ours reads errno or floating-point traps; NaN and infinity keep their meaning.
  target_compile_options(${target} PRIVATE -fno-math-errno -fno-trapping-math)
  if(FARFIELD_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${FARFIELD_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${FARFIELD_SANITIZE})
  endif()
endfunction()

# farfield_add_room(NAME SOURCES a.cpp ... LINK public libs ... LINK_PRIVATE private libs ...)
# Makes the static library farfield_NAME; its headers are included as "NAME/header.h".
function(farfield_add_room name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;LINK_PRIVATE" ${ARGN})
  add_library(farfield_${name} STATIC ${ARG_SOURCES})
  target_include_directories(farfield_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(farfield_${name} PUBLIC ${ARG_LINK} PRIVATE ${ARG_LINK_PRIVATE})
  farfield_configure(farfield_${name})
endfunction()

# farfield_add_test(NAME SOURCES a_test.cpp ... LINK libs ...) makes the GoogleTest program NAME and lists its
# cases in ctest. FARFIELD_SHARED_ASSETS and FARFIELD_TEST_DATA are paths a test may read; the former may not exist.
function(farfield_add_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} GTest::gtest GTest::gtest_main)
  farfield_configure(${name})
  # Reading gtest's headers is half of a test's compile time: several files are compiled as one.
  set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 6)
  target_compile_definitions(${name} PRIVATE
    FARFIELD_SHARED_ASSETS="${PROJECT_SOURCE_DIR}/../shared/assets"
    FARFIELD_TEST_DATA="${PROJECT_SOURCE_DIR}/tests/data")
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT ${ARG_TIMEOUT})
endfunction()

# farfield_add_bench(NAME SOURCES a_bench.cpp ... LINK libs ...) makes the google-benchmark program NAME.
function(farfield_add_bench name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} benchmark::benchmark)
  farfield_configure(${name})
endfunction()
