// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon {

/// Whether a stored model or transfer may be replaced by one that has the same name and other
/// content. A model or transfer that has changed on the disk may always be replaced.
enum class Replacing {
  kAlways,        ///< by the result of a job
  kUnlessPinned,  ///< by an import of a caller that may also delete models
  kNever,         ///< by any other import
};

}  // namespace carillon
