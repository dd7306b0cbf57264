// SPDX-License-Identifier: Apache-2.0
// Reads the input as the requests of a rendering, in protobuf's delimited form, and renders one
// second of the contacts that are accepted. The database has one small model, "modalModels/aaa...".
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <array>
#include <cstdint>

#include "server/api/convert/trace_reader.h"
#include "tests/server/mode_database/sample_model.h"
#include "tests/server/scene/small_model.h"

namespace carillon {
namespace {

/// What the daemon has for all renderings.
class Rooms {
 public:
  Rooms() {
    const std::string digest = SmallModel()->digest;
    WriteRecords(folder_ / "model", SampleRecords(*SmallModel()));
    if (!database->models().PutFile(digest, "small", folder_ / "model").ok()) __builtin_trap();
  }

 private:
  TemporaryFolder folder_;
  SystemClock clock_;

 public:
  std::unique_ptr<ModeDatabase> database = *ModeDatabase::Open(folder_ / "carillon.db", clock_);
  BodyCache bodies;
  HeadStore heads{"/none.sofa"};  // to read one for each sample rate would take most of the time
};

void Render(Rooms& rooms, const uint8_t* data, size_t size) {
  google::protobuf::io::ArrayInputStream input(data, static_cast<int>(size));
  TraceReader reader(*rooms.database, rooms.heads, rooms.bodies);
  v1::RenderRequest request;
  bool at_end = false;
  while (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&request, &input, &at_end)) {
    if (!reader.Take(request).ok()) return;
    request.Clear();
  }
  if (!reader.Finish().ok()) return;
  std::array<float, 8 * OfflineRenderer::kBlockFrameCount> samples{};
  for (int block = 0; block < 48 && reader.renderer()->Render(samples) > 0; ++block) {
    for (const float sample : samples) {
      if (!(sample >= -1 && sample <= 1)) __builtin_trap();
    }
  }
}

}  // namespace
}  // namespace carillon

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static carillon::Rooms rooms;
  carillon::Render(rooms, data, size);
  return 0;
}
