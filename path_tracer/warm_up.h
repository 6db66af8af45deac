// SPDX-License-Identifier: Apache-2.0
// Makes a process take the memory that rendering needs besides assets, so that what it takes afterwards is assets.
//
// The budget is a promise about the resident set: what the process holds beyond what it held before it opened the
// assets. Code pages that are touched for the first time, thread stacks, Embree's and the image writers' own tables
// would count as assets if they came later: here they all come first.
#pragma once

#include "base/embree.h"
#include "base/result.h"
#include "path_tracer/image.h"

namespace farfield {

/// Renders a tiny asset of its own through a throw-away Runtime on all threads, writes `frame` (the film that later
/// frames use) as EXR and PNG to the temporary folder, and gives free memory back to the system but for what the
/// writers use. `with_textures`: looks textures up, too. Nothing stays on disk. Errors: Io (no temporary folder), those
/// of Runtime.
Result<void> warm_up(EmbreeDeviceRef device, const Image& frame, bool with_textures);

}  // namespace farfield
