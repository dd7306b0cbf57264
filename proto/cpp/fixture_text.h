// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "carillon/v1/modal_model.pb.h"

namespace carillon {

/// Reads a fixture as command lines write it, with lengths in metres:
///
///     plane:PX,PY,PZ/NX,NY,NZ    a point of the plane, and its normal (toward the free side)
///     box:X0,Y0,Z0/X1,Y1,Z1      two opposite corners
///     vertices:I,J,...           at most kMaxFixedVertices
///     group:NAME                 at most 200 bytes, without line breaks
///
/// Errors: INVALID_SETTINGS.
absl::StatusOr<v1::Fixture> ParseFixture(absl::string_view text);

/// Returns the canonical text of a fixture, which ParseFixture reads. It has shortest decimals,
/// ascending vertices without repetition, the lower corner of a box first, and a normal of length
/// one. Errors: INVALID_SETTINGS (the fixture is empty, a number is not finite, a limit is
/// exceeded).
absl::StatusOr<std::string> FixtureText(const v1::Fixture& fixture);

inline constexpr int kMaxFixedVertices =
    10'000;  // their text must fit in one argument of a program

}  // namespace carillon
