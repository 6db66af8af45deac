// SPDX-License-Identifier: Apache-2.0
// The project's Result is the one that hosts see; here are two macros that hand errors on, and what goes with one.
//
//   FARFIELD_TRY(write_file(path, bytes));               // returns the error, if it is one
//   FARFIELD_TRY_LET(const auto mesh, read_mesh(path));  // the same, else `mesh` is the value
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "farfield/result.h"  // IWYU pragma: export

#define FARFIELD_TRY_JOIN_(a, b) a##b
#define FARFIELD_TRY_NAME_(line) FARFIELD_TRY_JOIN_(farfield_result_, line)
#define FARFIELD_TRY_LET_(result, declaration, ...)                      \
  auto result = (__VA_ARGS__);                                           \
  if (!result) return tl::unexpected<::farfield::Error>(result.error()); \
  declaration = std::move(*result)

/// Evaluates a Result; if it is an error, returns that from the enclosing function.
#define FARFIELD_TRY(...)                                                           \
  do {                                                                              \
    if (auto farfield_result = (__VA_ARGS__); !farfield_result) {                   \
      return tl::unexpected<::farfield::Error>(std::move(farfield_result).error()); \
    }                                                                               \
  } while (false)

/// The same for a Result with a value, which it moves into the declared variable. One per line.
#define FARFIELD_TRY_LET(declaration, ...) FARFIELD_TRY_LET_(FARFIELD_TRY_NAME_(__LINE__), declaration, __VA_ARGS__)

namespace farfield {

/// The result; an error takes along the warnings that came before it. `earlier` is read when the result is there:
/// with_warnings(reader.read(), reader.warnings()) is fine.
template <typename T>
Result<T> with_warnings(Result<T>&& result, const std::vector<std::string>& earlier) {
  if (!result) {
    std::vector<std::string>& warnings = result.error().warnings;
    warnings.insert(warnings.begin(), earlier.begin(), earlier.end());
  }
  return std::move(result);
}

}  // namespace farfield
