// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/maintenance/database_keeper.h"

namespace carillon {

void DatabaseKeeper::Look() {
  const absl::Status state = database_.TryAgain();
  if (last_ != state) observer_(state);
  last_ = state;
  // Pages that cannot be freed now are tried again at the next look.
  if (state.ok()) database_.Tidy().IgnoreError();
}

}  // namespace carillon
