// SPDX-License-Identifier: Apache-2.0
#include "server/api/client_keeper.h"

#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/api/resource_name.h"

namespace carillon {
namespace {

constexpr std::chrono::milliseconds kPeriod(250);

}  // namespace

ClientKeeper::ClientKeeper(Kept kept) : kept_(std::move(kept)), thread_([this] { Run(); }) {}

ClientKeeper::~ClientKeeper() {
  stop_.release();
  thread_.join();
}

void ClientKeeper::Run() {
  while (!stop_.try_acquire_for(kPeriod)) {
    for (const uint64_t scene : kept_.owners.leases().Expired()) {
      // Somebody may have deleted it meanwhile.
      const bool ended = kept_.scenes.DeleteScene(scene).ok();
      kept_.owners.Remove(scene);
      if (ended) kept_.log(absl::StrCat(SceneName(scene), " has ended: its clients have gone"));
    }
    kept_.idle_calls.EndIdle(kept_.idle_limit);
    kept_.tick();
  }
}

}  // namespace carillon
