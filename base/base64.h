// SPDX-License-Identifier: Apache-2.0
// Bytes as text, for data URIs.
#pragma once

#include <string>

namespace farfield {

/// Bytes as RFC 4648 writes them, padded.
std::string base64(const std::string& bytes);

}  // namespace farfield
