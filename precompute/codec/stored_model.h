// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/codec/modal_model_codec.h"
#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// A modal model with the origin that its file's header states.
struct StoredModel {
  ModalModel model;
  ModelOrigin origin;
};

}  // namespace carillon::precompute
