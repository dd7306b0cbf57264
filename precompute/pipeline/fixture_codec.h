// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "carillon/v1/modal_model.pb.h"
#include "precompute/mesh/fix_nodes.h"

namespace carillon::precompute {

/// Returns a fixture of the contract in the form that ParseFixture returns: the normal of a plane
/// has length one, and the first corner of a box is the least one.
Fixture FromProto(const v1::Fixture& given);

}  // namespace carillon::precompute
