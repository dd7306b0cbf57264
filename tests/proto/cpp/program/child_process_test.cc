// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/program/child_process.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <limits>

namespace carillon {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr size_t kAll = std::numeric_limits<size_t>::max();

/// What a shell script prints to its standard output, and how it ends.
struct Printed {
  std::string output;
  ProcessEnd end;
};

Printed RunScript(const std::string& script, ChildCommand command = {}) {
  Pipe output = *Pipe::Make();
  command.words = {"sh", "-c", script};
  command.output = output.write_end();
  absl::StatusOr<ChildProcess> child = ChildProcess::Start(command);
  EXPECT_TRUE(child.ok()) << child.status();
  output.CloseWriteEnd();
  std::string text = output.Read(kAll);
  return {std::move(text), child->Wait()};
}

TEST(ChildProcess, TellsExitStatusAndSignalAlsoIfItsParentWasStartedWithSigchldIgnored) {
  std::signal(SIGCHLD, SIG_IGN);
  const Printed printed = RunScript("sed -n 's/^SigIgn:\t//p' /proc/self/status; exit 7");
  EXPECT_TRUE(printed.end.exited);
  EXPECT_EQ(printed.end.status, 7);
  EXPECT_EQ(printed.output, "0000000000000000\n") << "the child ignores no signal, either";
  const ProcessEnd killed = RunScript("kill -TERM $$").end;
  EXPECT_FALSE(killed.exited);
  EXPECT_EQ(killed.status, SIGTERM);
}

TEST(ChildProcess, TellsWhetherItComputesOrSleeps) {
  Pipe output = *Pipe::Make();
  auto child = ChildProcess::Start(
      {.words = {"sh", "-c", "for i in $(seq 30000); do :; done; echo; kill -STOP $$; sleep 1000"},
       .output = output.write_end()});
  ASSERT_TRUE(child.ok()) << child.status();
  EXPECT_FALSE(output.Read(1).empty());
  while (!child->Sleeps()) {
  }
  EXPECT_GT(child->ProcessorTime(), std::chrono::milliseconds(1));
  auto busy = ChildProcess::Start({.words = {"sh", "-c", "while :; do :; done"}});
  const std::chrono::nanoseconds before = busy->ProcessorTime();
  while (busy->ProcessorTime() < before + std::chrono::milliseconds(50))
    EXPECT_FALSE(busy->Sleeps());
}

TEST(ChildProcess, AProgramThatCannotBeExecutedIsAnErrorOfTheStart) {
  const auto child = ChildProcess::Start({.words = {"/nowhere/carillon-precompute"}});
  EXPECT_TRUE(absl::IsFailedPrecondition(child.status()));
  EXPECT_THAT(child.status().ToString(), HasSubstr("WORKER_NOT_FOUND: /nowhere/carillon"));
}

TEST(ChildProcess, HasNoDescriptorsButThoseItWasGiven) {
  // Inherited by every process that is not protected from it.
  const int stray = open("/dev/null", O_RDONLY);  // NOLINT(android-cloexec-open)
  Pipe events = *Pipe::Make();
  const Printed with_events =
      RunScript("ls /proc/$$/fd; echo event >&3", {.events = events.write_end()});
  EXPECT_EQ(with_events.output, "0\n1\n2\n3\n");
  events.CloseWriteEnd();
  EXPECT_EQ(events.Read(kAll), "event\n");
  EXPECT_EQ(RunScript("ls /proc/$$/fd; true").output, "0\n1\n2\n");
  close(stray);
}

TEST(ChildProcess, AWorkerTakesItsWholeGroupWithItWhenItEnds) {
  Pipe output = *Pipe::Make();
  // The grandchild holds the pipe open until it is killed.
  auto worker = ChildProcess::Start({.words = {"sh", "-c", "sleep 1000 & nice; exit 0"},
                                     .output = output.write_end(),
                                     .worker_processor_count = 1});
  ASSERT_TRUE(worker.ok()) << worker.status();
  output.CloseWriteEnd();
  EXPECT_TRUE(worker->Wait().exited);
  EXPECT_THAT(output.Read(kAll), ::testing::MatchesRegex("1[0-9]\n"));
}

TEST(ChildProcess, AWorkerGetsOnlyTheVariablesThatItNeedsAndNoPrivileges) {
  setenv("CARILLON_TOKEN", "secret", 1);
  setenv("LC_TIME", "C", 1);
  const std::string variables =
      RunScript("env; grep NoNewPrivs /proc/self/status", {.worker_processor_count = 1}).output;
  EXPECT_THAT(variables, Not(HasSubstr("secret")));
  EXPECT_THAT(variables, HasSubstr("LC_TIME=C"));
  EXPECT_THAT(variables, HasSubstr("PATH="));
  EXPECT_THAT(variables, HasSubstr("NoNewPrivs:\t1\n"));
  EXPECT_THAT(RunScript("env").output, HasSubstr("secret"));
  unsetenv("CARILLON_TOKEN");
}

}  // namespace
}  // namespace carillon
