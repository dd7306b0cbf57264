// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <span>
#include <string>

namespace carillon::precompute {

/// Lets this process, and all processes that it starts from now on, make, write and remove files
/// only in the folders of `files` and below them, and write to /dev/null. Files that are open
/// already stay usable. Meshes are untrusted: a fault in a library that reads them must not
/// reach other files. Does nothing where the kernel has no Landlock. Call it before the first
/// thread starts.
void ConfineWrites(std::span<const std::string> files);

}  // namespace carillon::precompute
