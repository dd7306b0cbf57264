// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "carillon/v1/modal_model.pb.h"
#include "precompute/mesh/hold.h"

namespace carillon::precompute {

/// A fixture of the contract, which FixtureText accepts, and back.
Fixture FromProto(const v1::Fixture& said);
v1::Fixture ToProto(const Fixture& fixture);

}  // namespace carillon::precompute
