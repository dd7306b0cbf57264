// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/command_words.h"

#include <gtest/gtest.h>

#include <string>

namespace carillon::cli {
namespace {

std::string Translated(absl::string_view message) {
  return InCommandWords(message, [](const std::string&) { return true; });
}

TEST(CommandWords, TakeThePlaceOfFieldsAndCalls) {
  EXPECT_EQ(Translated("tail_s is -3; it must be 0 to 120"), "--tail is -3; it must be 0 to 120");
  EXPECT_EQ(Translated("young_pa, density_kg_per_m3 (or loss_factor)"),
            "--young, --density (or --loss-factor)");
  EXPECT_EQ(Translated("loss_factor.frequency_hz is 0"), "a frequency of --loss-factor is 0");
  EXPECT_EQ(Translated("there is no scenes/9; make one with SceneService.CreateScene"),
            "there is no scenes/9; name one that `carillon scene list` shows");
}

TEST(CommandWords, LeaveNamesOfFilesAndQuotedWordsAlone) {
  for (const char* text : {"", "my_tail_s: not found", "/tmp/tail_s/x", "tail_s_2", "x.tail_s",
                           "the .npz file has neither \"header\" nor \"poisson_ratio\""}) {
    EXPECT_EQ(Translated(text), text);
  }
}

TEST(CommandWords, NameNoOptionThatTheCommandLacks) {
  const auto of_render = [](const std::string& option) { return option == "--tail"; };
  EXPECT_EQ(InCommandWords("tail_s, young_pa and loss_factor.loss_factor", of_render),
            "--tail, young_pa and loss_factor.loss_factor");
  EXPECT_EQ(InCommandWords("CreateTransfer", of_render), "`carillon transfer create`");
}

}  // namespace
}  // namespace carillon::cli
