// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/trace_recorders.h"

#include <utility>

#include "server/api/convert/object_conversion.h"
#include "server/api/convert/pose_conversion.h"

namespace carillon {
namespace {

v1::ContactTraceRecord RecordOf(const v1::SoundingObject& object) {
  v1::ContactTraceRecord record;
  v1::ContactTraceObject& recorded = *record.mutable_object();
  recorded.set_handle(object.handle());
  recorded.set_modal_model(object.modal_model());
  *recorded.mutable_material() = object.material();
  recorded.set_size(object.size());
  recorded.set_gain(object.gain());
  if (object.has_pose()) *recorded.mutable_pose() = object.pose();
  recorded.set_radiation(object.radiation());
  return record;
}

}  // namespace

bool TraceRecorder::Add(std::shared_ptr<const v1::ContactTraceRecord> record, size_t byte_count) {
  {
    const MutexLock lock(&mutex_);
    if (left_) return false;
    waiting_byte_count_ += byte_count;
    overflowed_ |= waiting_.size() >= kMostWaiting || waiting_byte_count_ > kMostWaitingBytes;
    if (overflowed_) {
      waiting_.clear();
    } else {
      waiting_.push_back({std::move(record), byte_count});
    }
  }
  Wake();
  return !overflowed();
}

void TraceRecorder::End() {
  {
    const MutexLock lock(&mutex_);
    ended_ = true;
  }
  Wake();
}

void TraceRecorder::Leave() {
  {
    const MutexLock lock(&mutex_);
    left_ = true;
    waiting_.clear();
  }
  const MutexLock lock(&wake_mutex_);
  wake_ = nullptr;
}

void TraceRecorder::Wake() {
  const MutexLock lock(&wake_mutex_);
  if (wake_) wake_();
}

bool TraceRecorder::TryTake(v1::ContactTraceRecord& record) {
  Waiting next;
  {
    const MutexLock lock(&mutex_);
    if (waiting_.empty()) return false;
    next = std::move(waiting_.front());
    waiting_.pop_front();
    waiting_byte_count_ -= next.byte_count;
  }
  record = *next.record;
  return true;
}

bool TraceRecorder::ended() const {
  const MutexLock lock(&mutex_);
  return ended_;
}

bool TraceRecorder::overflowed() const {
  const MutexLock lock(&mutex_);
  return overflowed_;
}

void TraceRecorders::Add(const std::shared_ptr<TraceRecorder>& recorder) {
  const MutexLock lock(&mutex_);
  std::erase_if(waiting_, [](const auto& other) { return other.expired(); });
  waiting_.push_back(recorder);
}

std::vector<std::shared_ptr<TraceRecorder>> TraceRecorders::Take(uint64_t scene) {
  std::vector<std::shared_ptr<TraceRecorder>> taken;
  const MutexLock lock(&mutex_);
  std::erase_if(waiting_, [&](const std::weak_ptr<TraceRecorder>& waiting) {
    std::shared_ptr<TraceRecorder> recorder = waiting.lock();
    if (recorder != nullptr && recorder->scene() != scene) return false;
    if (recorder != nullptr) taken.push_back(std::move(recorder));
    return true;
  });
  return taken;
}

StreamRecording::StreamRecording(const SceneRegistry& scenes, uint64_t scene,
                                 const v1::ContactStreamStart& start,
                                 std::vector<std::shared_ptr<TraceRecorder>> recorders)
    : scenes_(&scenes), scene_(scene), recorders_(std::move(recorders)) {
  if (!active()) return;
  header_.set_format_version(1);
  header_.set_simulator("carillond");
  header_.set_step_s(start.step_s());
  header_.set_frame(start.frame());
  header_.set_pulse_shape(start.pulse_shape());
  if (const auto space = scenes.SpaceOf(scene); space.ok()) {
    *header_.mutable_hearing() = ToProto(space->hearing);
    *header_.mutable_listener() = ToProto(space->listener);
  }
  if (const auto entry = scenes.GetScene(scene); entry.ok()) header_.set_gain(entry->volume.gain);
  if (const auto bus = scenes.BusOf(scene); bus.ok()) {
    header_.mutable_clock()->set_stagger(static_cast<uint32_t>(Mixer::Stagger(*bus)));
  }
}

void StreamRecording::BeginStep() {
  const auto objects = scenes_->ListObjects(scene_);
  if (!objects.ok()) return;
  for (const PlacedObject& placed : *objects) {
    if (known_.insert(placed.handle).second) {
      new_objects_.push_back(RecordOf(ToProto(scenes_->NameOf(scene_), placed)));
    }
  }
}

void StreamRecording::AddStep(const v1::ContactStep& step, const TimeMapping& mapping) {
  if (!std::exchange(begun_, true)) {
    v1::ContactTraceClock& clock = *header_.mutable_clock();
    clock.set_first_frame(mapping.first_frame);
    clock.set_first_time_s(mapping.first_time_s);
    clock.set_scheduling_delay_s(mapping.delay_s);
    v1::ContactTraceRecord first;
    *first.mutable_header() = header_;
    Add(std::move(first));
  }
  for (v1::ContactTraceRecord& object : std::exchange(new_objects_, {})) Add(std::move(object));
  v1::ContactTraceRecord record;
  *record.mutable_step() = step;
  Add(std::move(record));
}

void StreamRecording::End() {
  for (const auto& recorder : recorders_) recorder->End();
  recorders_.clear();
}

void StreamRecording::Add(v1::ContactTraceRecord record) {
  const size_t byte_count = record.SpaceUsedLong();
  const auto shared = std::make_shared<const v1::ContactTraceRecord>(std::move(record));
  std::erase_if(recorders_,
                [&](const auto& recorder) { return !recorder->Add(shared, byte_count); });
}

}  // namespace carillon
