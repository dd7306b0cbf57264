// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/database_keeper.h"

#include <chrono>
#include <optional>
#include <utility>

namespace carillon {
namespace {

constexpr std::chrono::seconds kPeriod(1);

}  // namespace

DatabaseKeeper::DatabaseKeeper(Database& database, Observer observer)
    : database_(database), observer_(std::move(observer)), thread_([this] { Run(); }) {}

DatabaseKeeper::~DatabaseKeeper() {
  stop_.release();
  thread_.join();
}

void DatabaseKeeper::Run() {
  std::optional<absl::Status> last;
  do {
    const absl::Status files = database_.CheckFiles();
    if (last != files) observer_(files);
    last = files;
    // Pages that cannot be freed now are tried again in a second.
    if (files.ok()) database_.Tidy().IgnoreError();
  } while (!stop_.try_acquire_for(kPeriod));
}

}  // namespace carillon
