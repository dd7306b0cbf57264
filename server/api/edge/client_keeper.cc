// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/client_keeper.h"

#include <cstdint>
#include <string>

#include "absl/strings/str_cat.h"

namespace carillon {

void ClientKeeper::Look() const {
  for (const uint64_t scene : kept_.owners.leases().Expired()) {
    const std::string name = kept_.scenes.NameOf(scene);
    // A client may have deleted the scene meanwhile.
    const bool ended = kept_.scenes.DeleteScene(scene).ok();
    kept_.owners.Remove(scene);
    if (ended) kept_.log(absl::StrCat(name, " has ended: its clients have gone"));
  }
  kept_.idle_calls.EndIdle(kept_.idle_limit);
}

}  // namespace carillon
