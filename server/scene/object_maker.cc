// SPDX-License-Identifier: Apache-2.0
#include "server/scene/object_maker.h"

#include <utility>

#include "proto/cpp/status_macros.h"

namespace carillon {

absl::StatusOr<SoundingObject> ObjectMaker::Make(const Scene& scene, const NewObject& object) {
  ASSIGN_OR_RETURN(std::shared_ptr<const SoundingBody> body, bodies_.Get(object.model));
  auto voice = MakeVoice(scene.space(), object.properties.pose, mixer_.settings());
  return MakeSoundingObject(std::move(body), object.properties, {mixer_, scene.bus()},
                            std::move(voice), transfers_);
}

absl::StatusOr<SoundingObject> ObjectMaker::Remake(const SoundingObject& old,
                                                   const ObjectProperties& properties) {
  return MakeSoundingObject(old.body, properties, {mixer_, old.bus}, old.voice, transfers_);
}

bool ObjectMaker::HasBestTransfer(const SoundingObject& object) const {
  const auto transfer = ChooseTransfer(*object.body->model, object.properties, transfers_);
  return !transfer.ok() || *transfer == object.transfer;
}

}  // namespace carillon
