// SPDX-License-Identifier: Apache-2.0
// Models small enough to bake in a test.
#pragma once

#include <filesystem>

namespace farfield::test {

/// An OBJ with its MTL: a trunk and `leaves` leaf quads in two greens, about 2 units wide.
void write_bush_obj(const std::filesystem::path& path, int leaves);

/// A glTF scene (.gltf, with its buffer inside) with two instances of a mesh of `leaves` quads, a sun, and a camera
/// that draws back from them over one second.
void write_bush_scene(const std::filesystem::path& path, int leaves);

}  // namespace farfield::test
