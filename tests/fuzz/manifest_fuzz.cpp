// SPDX-License-Identifier: Apache-2.0
// Manifests: whatever is accepted can be written, and what was written reads back the same.
#include <string>

#include "base/check.h"
#include "cache/manifest.h"
#include "fuzz_targets.h"

namespace farfield {

void fuzz_manifest(std::span<const uint8_t> data) {
  const std::string text(data.begin(), data.end());
  const Result<Manifest> manifest = manifest_from_json(text, "fuzz");
  if (!manifest) {
    FARFIELD_CHECK(manifest.error().message.find('\n') == std::string::npos);
    return;
  }
  const std::string written = manifest_to_json(*manifest);
  const Result<Manifest> again = manifest_from_json(written, "fuzz");
  FARFIELD_CHECK(again);
  FARFIELD_CHECK(manifest_to_json(*again) == written);
}

}  // namespace farfield
