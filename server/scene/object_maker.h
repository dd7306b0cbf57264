// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "server/scene/scene.h"
#include "server/scene/sounding_body.h"
#include "server/scene/sounding_object.h"

namespace carillon {

/// An object, and the handle by which contacts name the object.
struct PlacedObject {
  uint32_t handle = 0;
  SoundingObject object;
};

/// An object to be made.
struct NewObject {
  uint32_t handle = 0;  ///< zero stands for any free handle
  std::shared_ptr<const ModalModel> model;
  ObjectProperties properties;
};

/// Makes the objects of live scenes. An oscillator bank takes about half a millisecond, so callers
/// hold no lock that others wait for. Safe from every thread.
class ObjectMaker {
 public:
  /// `mixer` and `transfers` must outlive this. `transfers` is null if none are stored.
  ObjectMaker(Mixer& mixer, TransferStore* transfers) : mixer_(mixer), transfers_(transfers) {}

  /// Makes an object that is heard as the others of `scene`, and is in no scene yet. Errors: those
  /// of MakeSoundingObject.
  absl::StatusOr<SoundingObject> Make(const Scene& scene, const NewObject& object);

  /// Makes an object with the surface, bus and voice of `old`. Errors: those of MakeSoundingObject.
  absl::StatusOr<SoundingObject> Remake(const SoundingObject& old,
                                        const ObjectProperties& properties);

  /// Returns whether no other stored transfer than the object's fits its properties better.
  bool HasBestTransfer(const SoundingObject& object) const;

 private:
  Mixer& mixer_;
  TransferStore* const transfers_;
  BodyCache bodies_;
};

}  // namespace carillon
