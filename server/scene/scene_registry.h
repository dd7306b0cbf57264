// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"
#include "server/scene/contact_stream.h"
#include "server/scene/object_maker.h"
#include "server/scene/rejection_counts.h"
#include "server/scene/scene.h"
#include "server/scene/scene_volumes.h"

namespace carillon {

/// A change of an object. Absent properties stay as they are.
struct ObjectChange {
  /// Replaces the material except for its size, which `size` below replaces.
  std::optional<SoundingMaterial> material;
  std::optional<double> poisson_ratio;  ///< Poisson's ratio of that material
  std::optional<double> size;
  std::optional<double> gain;
  std::optional<Pose> pose;
  std::optional<RadiationModel> radiation;
  double glide_s = 0;  ///< duration of the movement to the pose, 0 to 10; with 0 the object jumps
};

/// All scenes of the daemon, on one mixer. Safe from every thread.
class SceneRegistry {
 public:
  static constexpr size_t kMaxSceneCount = 512;
  static constexpr size_t kMaxObjectCount = 4096;

  /// `mixer` and `transfers` must outlive the registry. `transfers` is null if none are stored.
  explicit SceneRegistry(Mixer& mixer, TransferStore* transfers = nullptr)
      : mixer_(mixer), maker_(mixer, transfers), volumes_(mixer) {}

  /// Makes a scene and returns its number. `id` is the id within the scene's name; if it is empty,
  /// the number is the id. Errors: ResourceExhausted (TOO_MANY_SCENES), AlreadyExists
  /// (SCENE_ID_TAKEN), and those of Validate and ValidateGain.
  absl::StatusOr<uint64_t> CreateScene(const SceneSpace& space = {}, double gain = 1,
                                       const std::string& owner = "", const std::string& id = "");

  /// Returns the number of the scene with this id. Errors: NotFound (SCENE_NOT_FOUND).
  absl::StatusOr<uint64_t> FindId(const std::string& id) const;

  /// Returns "scenes/{id}", with the number as the id if the scene does not exist.
  std::string NameOf(uint64_t scene) const;

  /// Deletes the scene and fades its objects out. Errors: NotFound (SCENE_NOT_FOUND).
  absl::Status DeleteScene(uint64_t scene);

  /// A scene in a list of all.
  struct SceneEntry {
    uint64_t scene = 0;
    std::string name{};  ///< "scenes/{id}"
    size_t object_count = 0;
    SceneVolume volume{};
    BusState state{};
  };

  /// Returns all scenes, the oldest first.
  std::vector<SceneEntry> ListScenes() const;

  /// Returns the number of objects in these scenes, and of those that are being made for them.
  /// Scenes that do not exist have none.
  size_t CountObjects(std::span<const uint64_t> scenes) const;

  /// Returns a scene. Errors: NotFound (SCENE_NOT_FOUND).
  absl::StatusOr<SceneEntry> GetScene(uint64_t scene) const;

  /// Changes the volume of a scene. The volume glides to its new value within 30 ms. Errors:
  /// NotFound (SCENE_NOT_FOUND), InvalidArgument (INVALID_SETTINGS).
  absl::Status ChangeVolume(uint64_t scene, const SceneVolumeChange& change);

  /// Fades all sound of a scene out within 30 ms. Later contacts sound as usual. Errors: NotFound
  /// (SCENE_NOT_FOUND).
  absl::Status Stop(uint64_t scene);

  /// Returns the bus through which the objects of a scene sound. Errors: NotFound
  /// (SCENE_NOT_FOUND).
  absl::StatusOr<BusId> BusOf(uint64_t scene) const;

  /// Returns the spatial effects of a scene. Errors: NotFound (SCENE_NOT_FOUND).
  absl::StatusOr<SceneSpace> SpaceOf(uint64_t scene) const;

  /// Returns the objects of a scene by their handles. Errors: NotFound (SCENE_NOT_FOUND).
  absl::StatusOr<std::vector<PlacedObject>> ListObjects(uint64_t scene) const;

  /// Makes an object. If `handle` is zero, a free handle is chosen. Errors: NotFound
  /// (SCENE_NOT_FOUND), AlreadyExists (OBJECT_EXISTS), ResourceExhausted (TOO_MANY_OBJECTS), and
  /// those of MakeSoundingObject.
  absl::StatusOr<PlacedObject> AddObject(uint64_t scene, uint32_t handle,
                                         std::shared_ptr<const ModalModel> model,
                                         const ObjectProperties& properties);

  /// Makes either all of the objects or none of them. An object without a handle gets one that no
  /// other of `objects` asks for. Nothing is added once `goes_on`, which is asked before each
  /// object is made, returns false. Errors: those of AddObject, by AtElement ("objects") if there
  /// are several, and Cancelled.
  absl::StatusOr<std::vector<PlacedObject>> AddObjects(
      uint64_t scene, const std::vector<NewObject>& objects,
      absl::FunctionRef<bool()> goes_on = [] { return true; });

  /// Changes an object. If more than the pose changes, a new oscillator bank takes further
  /// impulses, and the old bank decays. Errors: NotFound (SCENE_NOT_FOUND, OBJECT_NOT_FOUND),
  /// InvalidArgument (INVALID_SETTINGS), and those of MakeSoundingObject.
  absl::StatusOr<PlacedObject> UpdateObject(uint64_t scene, uint32_t handle,
                                            const ObjectChange& change);

  /// Gives each object with this model the stored transfer that fits the object best. A new
  /// oscillator bank takes further impulses, and the old bank decays.
  void TakeOverTransfers(const std::string& model_digest);

  /// Moves the listener to `pose` within `glide_s`, which has the limits of ObjectChange::glide_s.
  /// Errors: NotFound (SCENE_NOT_FOUND), InvalidArgument (INVALID_POSE, INVALID_SETTINGS).
  absl::Status UpdateListener(uint64_t scene, const Pose& pose, double glide_s);

  /// Fades the object out. Errors: NotFound (SCENE_NOT_FOUND, OBJECT_NOT_FOUND).
  absl::Status RemoveObject(uint64_t scene, uint32_t handle);

  /// Opens a contact stream. Errors: NotFound (SCENE_NOT_FOUND), InvalidArgument (INVALID_STREAM),
  /// ResourceExhausted (TOO_MANY_STREAMS).
  absl::StatusOr<std::unique_ptr<ContactStream>> OpenContactStream(
      uint64_t scene, const ContactStreamSettings& settings);

  /// Number of objects in all scenes.
  size_t object_count() const;

  size_t scene_count() const;

  /// The format in which all scenes are rendered.
  const MixerSettings& mixer_settings() const { return mixer_.settings(); }

  /// Counts the rejected contacts of all streams.
  const RejectionCounts& rejections() const { return rejections_; }

 private:
  absl::StatusOr<std::shared_ptr<Scene>> FindScene(uint64_t scene) const;
  SceneEntry EntryOf(uint64_t id, const Scene& scene) const;
  /// Returns the refusal of an object as the caller is to see it. `index` is its place in the list.
  using ElementError = absl::FunctionRef<absl::Status(const absl::Status&, size_t index)>;

  /// Makes either all of the objects or none of them.
  absl::StatusOr<std::vector<PlacedObject>> Add(uint64_t scene, std::span<const NewObject> objects,
                                                ElementError at, absl::FunctionRef<bool()> goes_on);
  /// Counts objects of a scene that are about to be made. Errors: ResourceExhausted
  /// (TOO_MANY_OBJECTS).
  absl::Status ReserveObjects(uint64_t scene, size_t count, ElementError at);
  /// Ends the making of objects that ReserveObjects has counted. If they are not `placed`, they no
  /// longer count.
  void EndReservation(uint64_t scene, size_t count, bool placed);
  /// Makes objects that are in no scene yet and have no handle.
  absl::StatusOr<std::vector<PlacedObject>> MakeObjects(const Scene& scene,
                                                        std::span<const NewObject> objects,
                                                        ElementError at,
                                                        absl::FunctionRef<bool()> goes_on);
  void FadeOut(std::span<const PlacedObject> objects);
  /// Puts the objects that were `made` into the scene, and sets their handles. Errors: NotFound
  /// (SCENE_NOT_FOUND), AlreadyExists (OBJECT_EXISTS).
  absl::Status Place(Scene& scene, std::span<const NewObject> objects, ElementError at,
                     std::vector<PlacedObject>& made);
  /// Moves the listener of objects that were made for a listener at `listener` to where the
  /// scene's listener is now.
  void CatchUp(Scene& scene, std::span<const PlacedObject> placed, const Pose& listener);
  /// Makes `old`, a copy of an object of the scene, anew with the transfer that fits it best.
  void TakeOverTransfer(Scene& scene, uint32_t handle, const SoundingObject& old);
  /// Waits until this number of moves can be sent. Errors: ResourceExhausted (TOO_MANY_MOVES,
  /// TOO_MANY_STREAMS).
  absl::Status AwaitRoomForMoves(Scene& scene, size_t count)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene.change_mutex());
  static void SendMove(EventStream& moves, const SoundingObject& object,
                       const MixerEvent::Action& move);
  Motion MotionOf(const Pose& pose, double glide_s) const;

  Mixer& mixer_;
  ObjectMaker maker_;
  RejectionCounts rejections_;
  SceneVolumes volumes_;
  /// The number of calls of TakeOverTransfers. Objects during whose making it grows may lack a
  /// transfer.
  std::atomic<uint64_t> transfer_round_{0};
  mutable Mutex mutex_;
  std::map<uint64_t, std::shared_ptr<Scene>> scenes_ ABSL_GUARDED_BY(mutex_);
  /// The number of each scene by its id.
  std::map<std::string, uint64_t> numbers_ ABSL_GUARDED_BY(mutex_);
  uint64_t next_scene_ ABSL_GUARDED_BY(mutex_) = 1;
  /// Number of objects in all scenes, and of those that are being made.
  size_t object_count_ ABSL_GUARDED_BY(mutex_) = 0;
  /// Number of objects that are being made for each scene.
  std::map<uint64_t, size_t> being_made_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
