// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

absl::StatusOr<CommandLine> Read(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "carillond");
  return ReadCommandLine(static_cast<int>(arguments.size()), arguments.data(), "0");
}

/// The options of a command line, which must be right.
Options OptionsOf(const std::vector<const char*>& arguments) {
  const absl::StatusOr<CommandLine> command = Read(arguments);
  EXPECT_TRUE(command.ok()) << command.status();
  return command.ok() ? command->options : Options();
}

class OptionsFile : public testing::Test {
 protected:
  const char* Write(const std::string& text) {
    WriteBytes(file_, text);
    return file_.c_str();
  }

  void ExpectRefused(const std::string& text, const char* named) {
    EXPECT_THAT(Read({"--config", Write(text)}).status().ToString(),
                testing::AllOf(HasSubstr("INVALID_CONFIGURATION: "), HasSubstr(named)));
  }

 private:
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_ / "carillond.toml";
};

TEST_F(OptionsFile, FlagsWinOverTheFileAndTheFileOverTheDefaults) {
  const char* file = Write(
      "listen = [\"unix:/a\", \"127.0.0.1:1\"]\nsample_rate = 44100\nblock_frames = 64\nchannels = "
      "2\n");
  const Options options = OptionsOf({"--config", file, "--block-frames", "256"});
  EXPECT_THAT(options.addresses, ElementsAre("unix:/a", "127.0.0.1:1"));
  EXPECT_EQ(options.sample_rate_hz, 44100U);
  EXPECT_EQ(options.block_frame_count, 256U);
  EXPECT_EQ(options.channel_count, 2U);
  EXPECT_EQ(options.audio_device, "auto");
  EXPECT_THAT(
      OptionsOf({"--config", file, "--listen", "unix:/b", "--listen", "127.0.0.1:0"}).addresses,
      ElementsAre("unix:/b", "127.0.0.1:0"));
}

TEST(Options, AWordThatIsNoCommandOfTheDatabaseIsRefused) {
  EXPECT_FALSE(Read({"db", "backup", "backup.db"}).ok());
  EXPECT_FALSE(Read({"db"}).ok());
  EXPECT_FALSE(Read({"db", "restore"}).ok());
}

TEST_F(OptionsFile, TheFileInTheConfigurationDirectoryIsReadIfNoOtherIsNamed) {
  const std::filesystem::path file = Write("sample_rate = 44100\n");
  setenv("CONFIGURATION_DIRECTORY", file.parent_path().c_str(), 1);
  EXPECT_EQ(OptionsOf({}).sample_rate_hz, 44100U);
  setenv("CONFIGURATION_DIRECTORY", "/nonexistent", 1);
  EXPECT_EQ(OptionsOf({}).sample_rate_hz, 48000U);
  unsetenv("CONFIGURATION_DIRECTORY");
}

TEST_F(OptionsFile, WhatTheFileMayNotSayIsRefusedByName) {
  const auto expect = [&](const char* text, const char* named) { ExpectRefused(text, named); };
  expect("volume = 11\n", "volume");
  expect("sample_rate = \"high\"\n", "sample_rate");
  expect("\nsample_rate = 100\n",
         " line 2: sample_rate: \"100\" must be a number from 8000 to 192000");
  expect("block_frames = 4096\n", " line 1: block_frames: ");
  expect("memory_budget_mib = 1099511627777\n",
         "\"1099511627777\" must be a number from 0 to 1099511627776");
  expect("tls_key = \"key.pem\"\n", "--tls-certificate");
  expect("a = \n", "line 1");
  expect("workers = 1\nsample_rate = \"high\"\n", "line 2: sample_rate");
  expect("workers = 1\ntransfers = 1\n", "line 2: transfers has a value of the wrong type");
  expect("data_dir = \"\"\n", " line 1: data_dir: ");
  expect("scene_grace = -1\n", " line 1: scene_grace: ");
  expect("client_share = 0\n", " line 1: client_share: \"0\" must be a number from 0.001 to 1");
  expect("metrics = \"9464\"\n", " line 1: metrics: \"9464\" must be");
  expect("log_level = \"loud\"\n",
         " line 1: log_level: \"loud\" must be one of debug, info, warning, error");
  expect("log_level = \"off\"\n", " line 1: log_level");
  expect("channels = 1\nlisten = []\n", " line 2: listen names nothing");
  expect("listen = \"127.0.0.1:1\"\nmetrics = \"127.0.0.1:1\"\n",
         "--listen and --metrics both name 127.0.0.1:1");
  for (const char* address : {"a:1,b:2", "127.0.0.1:1,2", "127.0.0.1: 1", "127.0.0.1 :1", "[::1]:1",
                              "::1:1", ":1", "127.0.0.1:1s"}) {
    ExpectRefused(std::string("metrics = \"") + address + "\"\n",
                  "must be one HOST:PORT with an IPv4 address or a name");
  }
}

TEST_F(OptionsFile, NamesTheSettingsThatDiffer) {
  const Options first = OptionsOf({"--config", Write("client_share = 0.5\nworkers = 1\n")});
  const Options second =
      OptionsOf({"--config", Write("client_share = 0.25\nlisten = [\"unix:a\"]\n")});
  EXPECT_THAT(DifferentSettings(first, second), ElementsAre("listen", "client_share", "workers"));
  EXPECT_THAT(DifferentSettings(first, first), IsEmpty());
}

TEST_F(OptionsFile, WhatIsPrintedReadsBackAsTheSameSettings) {
  const absl::StatusOr<CommandLine> command =
      Read({"--print-config", "--listen", "unix:/a \"b\"", "--listen", "127.0.0.1:1", "--workers",
            "3", "--no-transfers", "--client-share", "0.25", "--metrics", "127.0.0.1:9464"});
  ASSERT_TRUE(command.ok()) << command.status();
  EXPECT_TRUE(command->only_print);
  const std::string printed = PrintConfiguration(command->options);
  EXPECT_THAT(printed, HasSubstr("\ntransfers = false\n"));
  EXPECT_EQ(OptionsOf({"--config", Write(printed)}), command->options);
}

TEST(Options, AFlagWithoutAValueDoesNotTakeTheNextFlagForItAndAMissingFileIsRefused) {
  EXPECT_THAT(Read({"--config", "/nonexistent.toml"}).status().ToString(),
              HasSubstr("INVALID_CONFIGURATION: /nonexistent.toml: "));
  EXPECT_THAT(Read({"--data-dir=", "--check-config"}).status().ToString(),
              testing::AllOf(HasSubstr("INVALID_CONFIGURATION: "), HasSubstr("--data-dir=")));
  EXPECT_THAT(Read({"--data-dir", "", "--check-config"}).status().ToString(),
              HasSubstr("INVALID_CONFIGURATION: "));
}

TEST(Options, AClusterRunsDecompositionsIfItHasAFolder) {
  EXPECT_FALSE(OptionsOf({}).uses_slurm());
  EXPECT_TRUE(OptionsOf({"--slurm-dir", "/shared"}).uses_slurm());
}

}  // namespace
}  // namespace carillon
