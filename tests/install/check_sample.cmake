# SPDX-License-Identifier: Apache-2.0
execute_process(COMMAND ${command} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT result STREQUAL exit_code OR NOT output MATCHES "${pattern}")
  message(FATAL_ERROR "exit code ${result}, not ${exit_code}; or it does not say '${pattern}':\n${output}")
endif()
