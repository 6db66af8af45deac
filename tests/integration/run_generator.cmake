# SPDX-License-Identifier: Apache-2.0
# run_generator(SCRIPT ARGUMENTS...) runs a script of ours that needs numpy. Without numpy the test that calls it ends,
# skipped.
macro(run_generator generator)
  execute_process(COMMAND ${generator} ${ARGN} RESULT_VARIABLE result ERROR_VARIABLE error OUTPUT_QUIET)
  if(error MATCHES "No module named 'numpy'")
    message("skipped: there is no numpy")
    return()
  endif()
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${generator} failed: ${error}")
  endif()
endmacro()
