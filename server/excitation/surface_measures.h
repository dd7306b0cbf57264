// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace carillon {

/// Returns the volume inside a closed surface, m^3, of #V vertices in metres and #T triangles.
/// Returns zero for a surface that encloses no volume.
double VolumeM3(std::span<const std::array<float, 3>> vertices,
                std::span<const std::array<uint32_t, 3>> triangles);

/// Returns the centre of mass of the homogeneous body inside a closed surface, metres, or that of
/// the vertices for a surface that encloses no volume.
std::array<double, 3> CentreM(std::span<const std::array<float, 3>> vertices,
                              std::span<const std::array<uint32_t, 3>> triangles);

/// Returns the tensor of inertia about its centre of mass of the homogeneous body of density 1
/// inside a closed surface, m^5. It is zero for a surface that encloses no volume.
std::array<std::array<double, 3>, 3> InertiaM5(std::span<const std::array<float, 3>> vertices,
                                               std::span<const std::array<uint32_t, 3>> triangles);

/// Returns the area of the triangles, m^2.
double AreaM2(std::span<const std::array<float, 3>> vertices,
              std::span<const std::array<uint32_t, 3>> triangles);

/// Returns the diagonal of the bounding box, metres.
double ExtentM(std::span<const std::array<float, 3>> vertices);

}  // namespace carillon
