# SPDX-License-Identifier: Apache-2.0
# -D tool=PROGRAM: fails if the loader brings OpenImageIO with it, directly or through another library.
execute_process(COMMAND ldd ${tool} RESULT_VARIABLE result OUTPUT_VARIABLE libraries ERROR_VARIABLE libraries)
if(NOT result EQUAL 0 OR NOT libraries MATCHES "libembree") # it does link Embree: the list is one
  message(FATAL_ERROR "ldd ${tool} failed (${result}):\n${libraries}")
endif()
if(libraries MATCHES "libOpenImageIO")
  message(FATAL_ERROR "${tool} links OpenImageIO, which costs every command 0.25 s:\n${libraries}")
endif()
