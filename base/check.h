// SPDX-License-Identifier: Apache-2.0
// Checks for bugs in our own code or in the caller's. Bad files are never checked this way: they are Errors.
#pragma once

namespace farfield::detail {
[[noreturn]] void check_failed(const char* condition, const char* file, int line);
}

/// Always on: stops the process with the condition and the place when it does not hold.
#define FARFIELD_CHECK(condition) \
  (static_cast<bool>(condition) ? void(0) : ::farfield::detail::check_failed(#condition, __FILE__, __LINE__))

/// As FARFIELD_CHECK in debug builds; nothing in release builds.
#ifdef NDEBUG
#define FARFIELD_ASSERT(condition) void(0)
#else
#define FARFIELD_ASSERT(condition) FARFIELD_CHECK(condition)
#endif
