// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/database_keeper.h"

namespace carillon {

void DatabaseKeeper::Look() {
  const absl::Status files = database_.CheckFiles();
  if (last_ != files) observer_(files);
  last_ = files;
  // Pages that cannot be freed now are tried again at the next look.
  if (files.ok()) database_.Tidy().IgnoreError();
}

}  // namespace carillon
