// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "server/excitation/yielding_contact.h"
#include "server/scene/sounding_object.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// Sets the gains of a blow on an object whose modes yield to the striker (YieldingGains). A blow
/// with a stated duration or a Gaussian pulse keeps all modes at 0 dB. In a collision of two
/// objects, each yields by itself, as if the other were rigid.
void LetYield(const SoundingObject& object, const Collision& collision, SurfaceImpulse& blow);

}  // namespace carillon
