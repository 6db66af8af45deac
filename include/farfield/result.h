// SPDX-License-Identifier: Apache-2.0
// Errors are values: every call that can fail on data or on the system returns a Result.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

namespace farfield {

/// What kind of failure an Error is; the message says the rest.
enum class ErrorCode {
  InvalidArgument,  ///< the caller's values are out of range
  NotFound,         ///< a file or folder does not exist
  Io,               ///< the system failed: permission, full disk, short read
  BadFile,          ///< a file's content is broken or not of the expected kind
  Unsupported,      ///< well formed, but this version does not handle it
  OutOfBudget,      ///< cannot fit the memory budget; the message has the number that would
  Cancelled,        ///< the caller asked to stop
};

/// A failure: its kind, and one line that names the file, the place in it and the remedy.
struct Error {
  ErrorCode code;
  std::string message;
  std::vector<std::string> warnings = {};  ///< what was noticed on the way to it, one line each: often why
};

/// Either a value or an Error. Never throws unless value() is called on an error.
template <typename T>
using Result = tl::expected<T, Error>;

/// Makes the error side of a Result.
inline tl::unexpected<Error> make_error(ErrorCode code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message), {}});
}

}  // namespace farfield
