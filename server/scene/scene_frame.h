// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "server/scene/object_contact.h"
#include "server/scene/sounding_object.h"

namespace carillon {

/// Transforms a contact whose points and impulse are in the scene's frame into the frames of its
/// objects, by their newest poses. An object without a pose lies at the origin, not rotated.
/// `second` is null for a contact of one object.
ObjectContact FromSceneFrame(ObjectContact contact, const SoundingObject& object,
                             const SoundingObject* second);

}  // namespace carillon
