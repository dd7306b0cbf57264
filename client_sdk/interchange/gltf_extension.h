// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon::interchange {

/// The draft extension of glTF 2.0 for modal models.
inline constexpr char kExtension[] = "KHR_audio_rigid_bodies";

/// A model fits a material whose Poisson's ratio differs by no more than this.
inline constexpr double kPoissonTolerance = 1e-4;

}  // namespace carillon::interchange
