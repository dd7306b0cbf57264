// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "server/mode_database/mode_database.h"
#include "tests/server/mode_database/sample_model.h"
#include "tests/server/mode_database/sample_transfer.h"
#include "tests/server/scene/stage.h"

namespace carillon {

/// SmallModel in a database.
struct StoredModel {
  StoredModel() {
    WriteRecords(folder / "model", SampleRecords(*SmallModel()));
    EXPECT_TRUE(database->models().PutFile(SmallModel()->digest, "", folder / "model").ok());
  }

  /// Stores a transfer of the model.
  void Store(SampleRadiation radiation) {
    radiation.speed_ratio = std::sqrt(kTestYoungPa / kTestDensityKgPerM3) / 343;
    const auto stored =
        database->transfers().Put(SmallModel()->digest, SampleTransfer(*SmallModel(), radiation));
    EXPECT_TRUE(stored.ok()) << stored.status();
  }

  TemporaryFolder folder;
  SystemClock clock;
  std::unique_ptr<ModeDatabase> database = *ModeDatabase::Open(folder / "carillon.db", clock);
};

/// A stage whose objects sound with the transfers of a database.
class TransferStage : public StoredModel, public Stage {
 public:
  explicit TransferStage(const SceneSpace& space = {}, const MixerSettings& settings = {})
      : Stage(space, settings, &database->transfers()) {
    model = *database->models().Find(SmallModel()->digest);
    database->transfers().Listen([this](const std::string& d) { scenes.TakeOverTransfers(d); });
  }
  ~TransferStage() { database->transfers().Listen(nullptr); }
};

}  // namespace carillon
