// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/contact_stream_call.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "absl/synchronization/notification.h"
#include "carillon/client.h"
#include "carillon/v1/contact_service.grpc.pb.h"

namespace carillon::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Answers a contact stream's start, and reads its steps when it may.
class SlowService final : public v1::ContactService::Service {
 public:
  grpc::Status StreamContacts(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::StreamContactsResponse, v1::StreamContactsRequest>* stream)
      override {
    v1::StreamContactsRequest request;
    v1::StreamContactsResponse answer;
    stream->Read(&request);
    stream->Write(answer);
    may_read.WaitForNotification();
    while (stream->Read(&request)) {
      message_sizes.push_back(request.ByteSizeLong());
      step_counts.push_back(request.steps_size());
      for (const v1::ContactStep& step : request.steps()) times_s.push_back(step.time_s());
    }
    answer.set_step_count(times_s.size());
    stream->Write(answer);
    return grpc::Status::OK;
  }

  absl::Notification may_read;
  std::vector<size_t> message_sizes;
  std::vector<int> step_counts;
  std::vector<double> times_s;
};

class ContactStreamCallTest : public testing::Test {
 protected:
  ContactStreamCallTest() {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    client_ = Connect("127.0.0.1:" + std::to_string(port));
    v1::ContactStreamStart start;
    start.set_step_s(0.01);
    stream_ = *client_->StreamContacts(start);
  }

  /// Sends `count` steps of `contact_count` contacts each, 10 ms apart.
  void Send(int count, int contact_count) {
    for (int i = 0; i < count; ++i) {
      v1::ContactStep step;
      step.set_time_s(0.01 * sent_count_++);
      for (int k = 0; k < contact_count; ++k) step.add_contacts()->set_object(7);
      ASSERT_TRUE(stream_->Send(std::move(step)).ok());
    }
  }

  /// Sends steps until some wait, because gRPC takes no more for a service that does not read.
  void MakeStepsWait() {
    while (stream_->WaitingStepCount() < 20 && sent_count_ < 10000) Send(1, 1000);
    ASSERT_GE(stream_->WaitingStepCount(), 20U);
  }

  /// Lets the service read, and checks that each step came once and in order.
  void Finish() {
    service_.may_read.Notify();
    const auto report = stream_->Finish();
    ASSERT_TRUE(report.ok());
    EXPECT_EQ(report->step_count(), static_cast<uint64_t>(sent_count_));
    EXPECT_EQ(stream_->WaitingStepCount(), 0U);
    EXPECT_EQ(stream_->DroppedStepCount(), 0U);
    EXPECT_TRUE(std::ranges::is_sorted(service_.times_s));
  }

  SlowService service_;
  std::unique_ptr<grpc::Server> server_;
  std::shared_ptr<Client> client_;
  std::unique_ptr<ContactStream> stream_;
  int sent_count_ = 0;
};

TEST_F(ContactStreamCallTest, StepsThatWaitAreSentTogether) {
  MakeStepsWait();
  const int sent_alone = sent_count_;
  Send(3000, 1);
  Finish();
  EXPECT_LT(service_.step_counts.size(), static_cast<size_t>(sent_alone + 50));
  EXPECT_EQ(std::ranges::max(service_.step_counts), 256);
}

TEST_F(ContactStreamCallTest, AMessageIsNoLargerThanItsFirstStepOr64KiB) {
  MakeStepsWait();
  Send(200, 500);
  Send(1, 30000);
  Send(200, 500);
  Finish();
  for (size_t i = 0; i < service_.step_counts.size(); ++i) {
    if (service_.step_counts[i] > 1) {
      EXPECT_LT(service_.message_sizes[i], 65U << 10U);
    }
  }
  EXPECT_EQ(std::ranges::count_if(service_.message_sizes, [](size_t size) { return size > 66560; }),
            1);
  EXPECT_GT(std::ranges::max(service_.step_counts), 1);
}

TEST_F(ContactStreamCallTest, WarnsOfTheStepsThatItDropped) {
  MakeStepsWait();
  // gRPC may still take a message or two, so that the number of steps that fill the queue is not
  // known.
  while (stream_->DroppedStepCount() < 100 && sent_count_ < 100000) Send(100, 1);
  service_.may_read.Notify();
  const auto report = stream_->Finish();
  ASSERT_TRUE(report.ok());
  const uint64_t dropped = stream_->DroppedStepCount();
  EXPECT_GE(dropped, 100U);
  EXPECT_EQ(report->step_count(), static_cast<uint64_t>(sent_count_) - dropped);
  ASSERT_EQ(report->warnings_size(), 1);
  EXPECT_EQ(report->warnings(0).id(), "STEPS_DROPPED");
  EXPECT_EQ(report->warnings(0).count(), dropped);
}

TEST_F(ContactStreamCallTest, RefusesAStepWhoseTimeIsTooLargeOrGoesBackAndGoesOn) {
  const auto send = [&](double time_s) {
    v1::ContactStep step;
    step.set_time_s(time_s);
    return stream_->Send(std::move(step)).ToString();
  };
  for (const double time_s : {std::nan(""), std::numeric_limits<double>::infinity(), -1.1e10}) {
    EXPECT_THAT(send(time_s), HasSubstr("INVALID_STREAM: time_s of step 0 is "));
  }
  // A simulation may begin at a time below zero, and two steps may have the same time.
  for (const double time_s : {-1.0, 2.0, 2.0}) EXPECT_EQ(send(time_s), "OK");
  EXPECT_THAT(send(1.5), HasSubstr("INVALID_STREAM: time goes back from 2 s to 1.5 s at step 3;"));
  EXPECT_EQ(send(3), "OK");
  sent_count_ = 4;
  Finish();
  EXPECT_THAT(service_.times_s, ElementsAre(-1, 2, 2, 3));
}

}  // namespace
}  // namespace carillon::client
