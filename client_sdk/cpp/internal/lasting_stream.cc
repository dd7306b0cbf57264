// SPDX-License-Identifier: Apache-2.0
#include "carillon/lasting_stream.h"

#include <cstdint>
#include <map>
#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

/// Whether the error says that the daemon has gone, and may come back. A daemon that stops cancels
/// its calls.
bool IsLoss(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsCancelled(status);
}

absl::Status Validate(const SceneRegistration& registration) {
  if (registration.scene.id().empty()) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   "a scene that is to be registered again needs an id: set CreateSceneRequest.id");
  }
  for (size_t i = 0; i < registration.objects.size(); ++i) {
    if (registration.objects[i].handle() != 0) continue;
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   absl::StrCat("objects[", i,
                                "] has no handle: give each object its own, above "
                                "zero"));
  }
  return absl::OkStatus();
}

/// The objects that a scene lacks. Errors: AlreadyExists (OBJECT_EXISTS).
absl::StatusOr<v1::AddObjectsRequest> MissingObjects(const Client& client, const std::string& scene,
                                                     const SceneRegistration& registration) {
  ASSIGN_OR_RETURN(const std::vector<v1::SoundingObject> present, client.ListObjects(scene));
  std::map<uint32_t, std::string> models;
  for (const v1::SoundingObject& object : present) models[object.handle()] = object.modal_model();
  v1::AddObjectsRequest missing;
  missing.set_scene(scene);
  for (const v1::NewObject& wanted : registration.objects) {
    const auto found = models.find(wanted.handle());
    if (found == models.end()) {
      *missing.add_objects() = wanted;
    } else if (found->second != wanted.modal_model()) {
      return Refusal(absl::StatusCode::kAlreadyExists, "OBJECT_EXISTS",
                     absl::StrCat(scene, "/objects/", wanted.handle(), " has the model ",
                                  found->second, " instead of ", wanted.modal_model(),
                                  ": remove it, or choose another handle"));
    }
  }
  return missing;
}

/// The newest of the streams to a scene, and the thread that opens the next one.
class LastingStream final : public ContactStream {
 public:
  LastingStream(const Client& client, SceneRegistration registration, v1::ContactStreamStart start,
                std::chrono::milliseconds retry)
      : client_(client),
        registration_(std::move(registration)),
        start_(std::move(start)),
        retry_(absl::FromChrono(retry)) {}

  ~LastingStream() override { Stop(); }

  /// Opens the first stream.
  absl::Status Open() {
    ASSIGN_OR_RETURN(std::unique_ptr<ContactStream> opened, Register());
    const absl::MutexLock lock(&mutex_);
    stream_ = std::move(opened);
    thread_ = std::thread([this] { Run(); });
    return absl::OkStatus();
  }

  absl::Status Send(v1::ContactStep step) override {
    const absl::MutexLock lock(&mutex_);
    if (!status_.ok()) return status_;
    if (stream_ != nullptr) {
      // A stream that has ended repeats its error, and a step that is refused ends no stream.
      absl::Status sent = stream_->Send(std::move(step));
      if (!IsLoss(sent)) return sent;
      status_ = std::move(sent);
      Lose();
    }
    ++dropped_step_count_;
    return absl::OkStatus();
  }

  size_t WaitingStepCount() const override {
    const absl::MutexLock lock(&mutex_);
    return stream_ == nullptr ? 0 : stream_->WaitingStepCount();
  }

  uint64_t DroppedStepCount() const override {
    const absl::MutexLock lock(&mutex_);
    return dropped_step_count_ + (stream_ == nullptr ? 0 : stream_->DroppedStepCount());
  }

  v1::StreamContactsResponse Report() const override {
    const absl::MutexLock lock(&mutex_);
    return stream_ == nullptr ? report_ : stream_->Report();
  }

  absl::StatusOr<v1::StreamContactsResponse> Finish() override {
    Stop();
    const absl::MutexLock lock(&mutex_);
    if (stream_ != nullptr) return stream_->Finish();
    return status_.ok() ? loss_ : status_;
  }

 private:
  /// Keeps the report of the stream whose connection is lost, and lets the thread open another.
  void Lose() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    loss_ = std::exchange(status_, absl::OkStatus());
    report_ = stream_->Report();
    dropped_step_count_ += stream_->DroppedStepCount() + stream_->WaitingStepCount();
    lost_ = std::move(stream_);
  }

  absl::StatusOr<std::unique_ptr<ContactStream>> Register() {
    ASSIGN_OR_RETURN(const std::string scene, RegisterScene(client_, registration_));
    start_.set_scene(scene);
    return client_.StreamContacts(start_);
  }

  void Run() {
    const absl::MutexLock lock(&mutex_);
    while (true) {
      mutex_.Await(absl::Condition(this, &LastingStream::HasWork));
      if (stopping_) return;
      // The destructor of a stream waits for the network library.
      const std::unique_ptr<ContactStream> lost = std::move(lost_);
      absl::StatusOr<std::unique_ptr<ContactStream>> opened = RegisterUnlocked();
      if (opened.ok()) {
        stream_ = *std::move(opened);
      } else if (IsLoss(opened.status()) || absl::IsDeadlineExceeded(opened.status())) {
        loss_ = opened.status();
        mutex_.AwaitWithTimeout(absl::Condition(&stopping_), retry_);
      } else {
        status_ = opened.status();
      }
    }
  }

  absl::StatusOr<std::unique_ptr<ContactStream>> RegisterUnlocked()
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    mutex_.Unlock();
    absl::StatusOr<std::unique_ptr<ContactStream>> opened = Register();
    mutex_.Lock();
    return opened;
  }

  bool HasWork() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return stopping_ || (stream_ == nullptr && status_.ok());
  }

  void Stop() {
    {
      const absl::MutexLock lock(&mutex_);
      stopping_ = true;
    }
    if (thread_.joinable()) thread_.join();
  }

  const Client& client_;
  const SceneRegistration registration_;
  v1::ContactStreamStart start_;  ///< used by Open, then by the thread
  const absl::Duration retry_;
  mutable absl::Mutex mutex_;
  std::unique_ptr<ContactStream> stream_ ABSL_GUARDED_BY(mutex_);  ///< null: none is open now
  std::unique_ptr<ContactStream> lost_ ABSL_GUARDED_BY(mutex_);    ///< to be destroyed
  absl::Status status_ ABSL_GUARDED_BY(mutex_);  ///< the error that has ended the stream for good
  absl::Status loss_ ABSL_GUARDED_BY(mutex_);    ///< why no stream is open
  v1::StreamContactsResponse report_ ABSL_GUARDED_BY(mutex_);
  uint64_t dropped_step_count_ ABSL_GUARDED_BY(mutex_) = 0;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace

absl::StatusOr<std::string> RegisterScene(const Client& client,
                                          const SceneRegistration& registration) {
  RETURN_IF_ERROR(Validate(registration));
  ASSIGN_OR_RETURN(const v1::CreateSceneResponse scene, client.CreateScene(registration.scene));
  ASSIGN_OR_RETURN(const v1::AddObjectsRequest missing,
                   MissingObjects(client, scene.name(), registration));
  if (missing.objects_size() > 0) RETURN_IF_ERROR(client.AddObjects(missing).status());
  return scene.name();
}

absl::StatusOr<std::unique_ptr<ContactStream>> OpenLastingStream(const Client& client,
                                                                 SceneRegistration registration,
                                                                 v1::ContactStreamStart start,
                                                                 std::chrono::milliseconds retry) {
  auto stream =
      std::make_unique<LastingStream>(client, std::move(registration), std::move(start), retry);
  RETURN_IF_ERROR(stream->Open());
  return stream;
}

}  // namespace carillon::client
