// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon::interchange {

/// The draft extension of glTF 2.0 for modal models.
inline constexpr char kExtension[] = "KHR_audio_rigid_bodies";

}  // namespace carillon::interchange
