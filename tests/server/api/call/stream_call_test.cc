// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/stream_call.h"

#include <gmock/gmock.h>
#include <google/protobuf/wrappers.pb.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <latch>
#include <string>
#include <utility>
#include <vector>

#include "proto/cpp/error_reason.h"
#include "server/api/call/chore.h"
#include "server/api/call/fair_turns.h"
#include "server/api/call/status_conversion.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;

using Number = google::protobuf::Int32Value;

/// Stands for gRPC's reactor, and records what it is asked to do.
class RecordingReactor {
 public:
  virtual ~RecordingReactor() = default;
  virtual void OnDone() = 0;
  virtual void OnReadDone(bool) {}
  virtual void OnWriteDone(bool) {}
  virtual void OnCancel() {}

  void StartRead(grpc::ByteBuffer* bytes) {
    ++read_count;
    reading = bytes;
  }
  void StartWrite(const std::string* response) { written.push_back(*response); }
  void Finish(const grpc::Status& status) { ends.push_back(status.error_code()); }

  void Receive(const std::string& message) {
    const grpc::Slice slice(message);
    *reading = grpc::ByteBuffer(&slice, 1);
    OnReadDone(true);
  }

  int read_count = 0;
  grpc::ByteBuffer* reading = nullptr;
  std::vector<std::string> written;
  std::vector<grpc::StatusCode> ends;
};

using Writer = StreamWriter<StreamCall<RecordingReactor>, std::string>;

/// Sends the messages given to it.
class MessageCall final : public Writer {
 public:
  MessageCall() : Writer(nullptr) {}
  using Writer::StartWriting;
  using Writer::Wake;

  void Send(const std::string& message) {
    waiting.push_back(message);
    Wake();
  }

  std::vector<std::string> waiting;
  bool last = false;
  std::function<void()> while_filling = [] {};

 private:
  absl::StatusOr<Supply> Fill(std::string& response) override {
    const bool empty = waiting.empty();
    while_filling();
    if (empty) return last ? Supply::kEnd : Supply::kLater;
    response = waiting.front();
    waiting.erase(waiting.begin());
    return Supply::kMessage;
  }
};

TEST(StreamWriter, WritesOneMessageAtATimeInOrder) {
  MessageCall call;
  call.StartWriting();
  call.Send("a");
  call.Send("b");
  call.Send("c");
  EXPECT_THAT(call.written, ElementsAre("a"));
  call.OnWriteDone(true);
  call.OnWriteDone(true);
  EXPECT_THAT(call.written, ElementsAre("a", "b", "c"));
  call.last = true;
  call.OnWriteDone(true);
  EXPECT_THAT(call.ends, ElementsAre(grpc::OK));
}

TEST(StreamWriter, WritesWhatComesWhileItFindsNothing) {
  MessageCall call;
  call.while_filling = [&call, first = true]() mutable {
    if (std::exchange(first, false)) call.Send("late");
  };
  call.StartWriting();
  EXPECT_THAT(call.written, ElementsAre("late"));
}

TEST(StreamWriter, EndsAtOnceWhereItIsCancelledWhileItWaits) {
  MessageCall call;
  call.StartWriting();
  call.OnCancel();
  EXPECT_THAT(call.ends, ElementsAre(grpc::CANCELLED));
  call.Send("too late");
  EXPECT_TRUE(call.written.empty());
  EXPECT_EQ(call.ends.size(), 1U);
}

/// Takes numbers up to 2.
class NumberCall final : public StreamReader<StreamCall<RecordingReactor>, Number> {
 public:
  NumberCall() : StreamReader(nullptr) { StartReading(); }
  std::vector<int> taken;
  bool all_read = false;
  bool is_gone = false;

  /// Receives the number of requests that were read.
  void ReceiveNext() {
    Number number;
    number.set_value(read_count);
    Receive(number.SerializeAsString());
  }

 private:
  bool gone() const override { return is_gone; }
  absl::Status Take(const Number& request) override {
    if (request.value() > 2) return absl::OutOfRangeError("too large");
    taken.push_back(request.value());
    return absl::OkStatus();
  }
  void AllRead() override { all_read = true; }
};

TEST(StreamReader, RefusesAMessageThatCannotBeParsedInsteadOfTakingItForTheEnd) {
  for (const int read_before : {0, 2}) {
    NumberCall call;
    for (int i = 0; i < read_before; ++i) call.ReceiveNext();
    call.Receive("\xff");
    EXPECT_THAT(call.ends, ElementsAre(grpc::INVALID_ARGUMENT));
    EXPECT_EQ(call.read_count, 1 + read_before);
    EXPECT_FALSE(call.all_read);
  }
}

TEST(StreamReader, TakesNothingMoreFromAClientThatHasGone) {
  NumberCall call;
  call.ReceiveNext();
  call.is_gone = true;
  call.ReceiveNext();
  EXPECT_THAT(call.taken, ElementsAre(1));
  EXPECT_THAT(call.ends, ElementsAre(grpc::CANCELLED));
}

TEST(Legible, WritesControlCharactersAndInvalidBytesInHexadecimal) {
  EXPECT_EQ(Legible("a\n\x1b[31mb"), "a\\x0a\\x1b[31mb");
  EXPECT_EQ(Legible("\u202e"), "\\xe2\\x80\\xae");
  EXPECT_EQ(Legible("x\x80\xc0\xaf\xff"), "x\\x80\\xc0\\xaf\\xff");
  EXPECT_EQ(Legible("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // a surrogate
  EXPECT_EQ(Legible("\xe9\x90"), "\\xe9\\x90");
}

TEST(ToGrpcStatus, FitsIntoTheMetadataOfEveryClient) {
  std::string input(4'000'000, '\x1b');
  input += ": give a name";
  absl::Status refusal = Refusal(absl::StatusCode::kInvalidArgument, "INVALID_NAME", input);
  AddFigure(refusal, "name", std::string(100'000, 'n'));
  const grpc::Status status = ToGrpcStatus(refusal);
  EXPECT_THAT(status.error_message(), testing::StartsWith("INVALID_NAME: "));
  EXPECT_THAT(status.error_message(), testing::EndsWith(": give a name"));
  EXPECT_LT(status.error_message().size() + status.error_details().size(), 4096U);
}

// What runs on the threads of a pool: chores, and the tasks of clients that take turns.

/// A chore on one thread. The pool ends before the chore.
struct OwnChore {
  explicit OwnChore(std::function<void()> work) : chore(pool, std::move(work)), pool(1) {}

  Chore chore;
  ThreadPool pool;
};

TEST(Chore, DoesNotWaitForItselfInThePool) {
  std::atomic<int> count{0};
  std::latch begun(1);
  std::latch go(1);
  OwnChore own([&] {
    if (++count == 1) begun.count_down();
    go.wait();
  });
  own.chore.Start();
  begun.wait();
  own.chore.Start();  // does nothing, because the work of the first call goes on
  go.count_down();
  own.chore.Stop();
  EXPECT_EQ(count, 1);
}

TEST(Chore, DoesNothingAfterItsEnd) {
  std::atomic<int> count{0};
  {
    OwnChore own([&] { ++count; });
    own.chore.Start();
    own.chore.Stop();
    own.chore.Start();
  }
  EXPECT_EQ(count, 1);
}

/// Turns on some threads of a pool. The pool ends before the turns.
struct SharedThreads {
  SharedThreads(int thread_count, int most_running)
      : turns(pool, most_running), pool(thread_count) {}

  FairTurns turns;
  ThreadPool pool;
};

TEST(FairTurns, AClientWithMuchWorkLeavesHalfOfTheThreadsToOthers) {
  std::latch go(1);
  std::latch other_ran(3);
  std::atomic<int> running{0};
  {
    SharedThreads threads(2, 2);
    for (int i = 0; i < 20; ++i) {
      threads.turns.Run("busy", [&] {
        EXPECT_EQ(++running, 1);
        go.wait();
        --running;
      });
    }
    for (int i = 0; i < 3; ++i) threads.turns.Run("other", [&] { other_ran.count_down(); });
    other_ran.wait();  // would not return if the busy client had both threads
    go.count_down();
  }
  EXPECT_EQ(running, 0);
}

TEST(FairTurns, ClientsTakeTurnsOnOneThread) {
  std::latch go(1);
  std::vector<int> order;
  {
    SharedThreads threads(1, 1);
    threads.turns.Run("first", [&] { go.wait(); });
    for (int i = 0; i < 3; ++i) threads.turns.Run("first", [&order] { order.push_back(1); });
    for (int i = 0; i < 2; ++i) threads.turns.Run("second", [&order] { order.push_back(2); });
    go.count_down();
  }
  EXPECT_THAT(order, testing::ElementsAre(2, 1, 2, 1, 1));
}

TEST(FairTurns, LeaveTheOtherThreadsToThePool) {
  std::latch both_run(2);
  std::latch go(1);
  std::latch other_ran(1);
  {
    SharedThreads threads(3, 2);
    for (const char* client : {"a", "a", "b", "b", "c", "c"}) {
      threads.turns.Run(client, [&] {
        if (!both_run.try_wait()) both_run.count_down();
        go.wait();
      });
    }
    both_run.wait();
    threads.pool.Run([&] { other_ran.count_down(); });
    other_ran.wait();  // would not return if the turns had all threads
    go.count_down();
  }
}

TEST(FairTurns, TheTasksOfAClientStartInOrderAndAllRun) {
  std::vector<int> order;
  {
    SharedThreads threads(2, 2);
    for (int i = 0; i < 100; ++i) threads.turns.Run("a", [&order, i] { order.push_back(i); });
  }
  EXPECT_EQ(order.size(), 100U);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

}  // namespace
}  // namespace carillon
