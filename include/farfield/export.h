// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Marks what the shared library exports.
#define FARFIELD_API __attribute__((visibility("default")))
