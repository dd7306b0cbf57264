// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/modal_model_codec.h"
#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// A modal model with what its header says beside it.
struct StoredModel {
  ModalModel model;
  ModelOrigin origin;
};

}  // namespace carillon::precompute
