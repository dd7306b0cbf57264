// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace carillon {

/// Returns the format that the suffix of a mesh file names, for example "obj". TetGen's ".ele"
/// names "node". The format need not be known.
std::string MeshFormatOf(const std::string& path);

/// Reads a mesh file as UploadMesh takes it: in one piece, with the data of other files that belong
/// to it.
///
///   - For the format "node" it returns TetGen's .node file followed by the .ele file, whichever of
///     them `path` names, also in capitals, unless one file contains both already.
///   - For a file *.gltf it returns the document with the data of its buffers in it. Their files
///     must be in the folder of `path` or below it.
///   - For the format "inp" it returns the file with those that it includes (*INCLUDE, and *NODE,
///     *ELEMENT, *NSET and *ELSET with INPUT=), which must be in the folder of `path` or below it.
///   - Other files it returns as they are.
///
/// Errors: NotFound (FILE_NOT_FOUND), ResourceExhausted (MESH_TOO_LARGE: above 256 MiB),
/// InvalidArgument (MESH_EMPTY; MESH_UNREADABLE: such a file is elsewhere).
absl::StatusOr<std::string> ReadMeshFile(const std::string& path, const std::string& format);

}  // namespace carillon
