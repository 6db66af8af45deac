# SPDX-License-Identifier: Apache-2.0
# Every third-party library, found once. Link them per target, PRIVATE: never one link line for everything.
# The Debian packages behind them are listed in scripts/packages.txt.
find_package(Threads REQUIRED)
find_package(TBB CONFIG REQUIRED COMPONENTS tbb) # first: the others reuse TBB::tbb
find_package(glm CONFIG REQUIRED)
find_package(tl-expected CONFIG REQUIRED)
find_package(embree 3.13 CONFIG REQUIRED)
find_package(nlohmann_json CONFIG REQUIRED)
find_package(fmt CONFIG REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(xxhash REQUIRED IMPORTED_TARGET libxxhash)

if(FARFIELD_BUILD_BAKE)
  pkg_check_modules(glu REQUIRED IMPORTED_TARGET glu)
  find_package(ZLIB REQUIRED)
  find_package(TinyGLTF CONFIG REQUIRED)
  # OpenImageIO's own CMake config is broken on Debian 12 (it wants tools that its -dev package does not bring).
  pkg_check_modules(oiio REQUIRED IMPORTED_TARGET OpenImageIO)
endif()
if(FARFIELD_BUILD_TOOLS)
  find_package(Imath 3.1 CONFIG REQUIRED)
  find_package(OpenEXR 3.1 CONFIG REQUIRED)
  find_package(CLI11 CONFIG REQUIRED)
  find_package(PNG REQUIRED)
endif()
if(FARFIELD_BUILD_TESTS)
  find_package(GTest CONFIG REQUIRED)
  include(GoogleTest)
endif()
if(FARFIELD_BUILD_BENCHES)
  find_package(benchmark CONFIG REQUIRED)
endif()
