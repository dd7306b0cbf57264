// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "carillon/v1/modal_model.pb.h"
#include "precompute/mesh/hold.h"

namespace carillon::precompute {

/// A fixture of the contract in the one form that ParseFixture gives it: a plane's normal has
/// length one, and a box its least corner first.
Fixture FromProto(const v1::Fixture& given);

}  // namespace carillon::precompute
