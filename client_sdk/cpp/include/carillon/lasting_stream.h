// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/client.h"
#include "carillon/contact_stream.h"

namespace carillon::client {

/// A scene and its objects as a program wants them, to be registered as often as needed.
struct SceneRegistration {
  /// The scene. Its id must not be empty, so that registering again finds it.
  v1::CreateSceneRequest scene;
  /// Its objects, each with a handle of its own above zero.
  std::vector<v1::NewObject> objects;
};

/// Makes a scene with its objects and returns its name. If the scene exists, objects of it that
/// have a wanted handle stay as they are, and the missing ones are added, so that the call may be
/// repeated after a lost connection or a restart of the daemon. Errors: INVALID_ARGUMENT
/// (INVALID_SETTINGS: no id, or an object without a handle), ALREADY_EXISTS
/// (OBJECT_EXISTS: an object of the scene has the handle and another model), and those of
/// SceneService.CreateScene and AddObjects.
absl::StatusOr<std::string> RegisterScene(const Client& client,
                                          const SceneRegistration& registration);

/// Registers a scene, and opens a contact stream to it that outlives its connection. When the
/// daemon does not answer any more, a thread tries every `retry` to register the scene again and to
/// open another stream, until the daemon is back. Send() goes on to return OK meanwhile, and drops
/// and counts the steps. All other errors end the stream. Report() and the result of Finish() are
/// those of the newest stream, whose counts begin at zero. `client` must outlive the stream; the
/// field `scene` of `start` is ignored. Errors: those of RegisterScene and Client::StreamContacts.
absl::StatusOr<std::unique_ptr<ContactStream>> OpenLastingStream(
    const Client& client, SceneRegistration registration, v1::ContactStreamStart start,
    std::chrono::milliseconds retry = std::chrono::milliseconds(500));

}  // namespace carillon::client
