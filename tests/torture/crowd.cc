// SPDX-License-Identifier: Apache-2.0
//
// Clients that strike four times a second each, every one over a connection and a stream of its
// own. Usage: crowd SERVER CLIENTS SECONDS DELAY_S SCENE HANDLE [SCENE HANDLE...] The clients share
// the scenes. Prints "ready" when all streams are open, and in the end the counts of all streams
// together.

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "carillon/v1/contact_service.grpc.pb.h"

namespace {

using carillon::v1::ContactService;
using carillon::v1::StreamContactsRequest;
using carillon::v1::StreamContactsResponse;
using std::chrono::steady_clock;

constexpr double kPeriodS = 0.25;

struct Target {
  std::string scene;
  uint32_t handle = 0;
};

double SecondsSince(steady_clock::time_point begin) {
  return std::chrono::duration<double>(steady_clock::now() - begin).count();
}

class CrowdClient {
 public:
  CrowdClient(const std::string& server, const Target& target, double delay_s)
      : handle_(target.handle) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    stub_ = ContactService::NewStub(
        grpc::CreateCustomChannel(server, grpc::InsecureChannelCredentials(), arguments));
    stream_ = stub_->StreamContacts(&context_);
    StreamContactsRequest request;
    request.mutable_start()->set_scene(target.scene);
    request.mutable_start()->set_step_s(kPeriodS);
    request.mutable_start()->set_scheduling_delay_s(delay_s);
    stream_->Write(request);
  }

  void Strike(double time_s) {
    StreamContactsRequest request;
    carillon::v1::ContactStep& step = *request.add_steps();
    step.set_time_s(time_s);
    carillon::v1::Contact& impulse = *step.add_contacts();
    impulse.set_kind(carillon::v1::CONTACT_KIND_IMPACT);
    impulse.set_object(handle_);
    impulse.mutable_point_m()->set_z(0.01F);
    impulse.mutable_impulse_newton_seconds()->set_z(-1e-5F);
    impulse.set_duration_s(1e-3F);
    if (stream_->Write(request)) ++sent_count_;
  }

  StreamContactsResponse Finish() {
    stream_->WritesDone();
    StreamContactsResponse response;
    while (stream_->Read(&response)) {
    }
    ok_ = stream_->Finish().ok();
    return response;
  }

  uint64_t sent_count() const { return sent_count_; }
  bool ok() const { return ok_; }

 private:
  uint32_t handle_;
  grpc::ClientContext context_;
  std::unique_ptr<ContactService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<StreamContactsRequest, StreamContactsResponse>> stream_;
  uint64_t sent_count_ = 0;
  bool ok_ = false;
};

using Crowd = std::vector<std::unique_ptr<CrowdClient>>;

/// The clients strike in turn, at equal intervals.
void StrikeInTurn(double seconds, Crowd& crowd) {
  const steady_clock::time_point begin = steady_clock::now();
  const double interval_s = kPeriodS / static_cast<double>(crowd.size());
  for (uint64_t number = 0;; ++number) {
    const double due_s = interval_s * static_cast<double>(number);
    if (due_s >= seconds) return;
    std::this_thread::sleep_until(begin + std::chrono::duration_cast<steady_clock::duration>(
                                              std::chrono::duration<double>(due_s)));
    crowd[number % crowd.size()]->Strike(SecondsSince(begin));
  }
}

void PrintCounts(Crowd& crowd) {
  uint64_t sent = 0, accepted = 0, late = 0, lost = 0, failed = 0;
  for (const auto& client : crowd) {
    const StreamContactsResponse response = client->Finish();
    sent += client->sent_count();
    accepted += response.accepted_count();
    late += response.late_count();
    lost += response.dropped_count() + response.rejected_count();
    failed += client->ok() ? 0 : 1;
  }
  std::cout << "{\"sent\": " << sent << ", \"accepted\": " << accepted << ", \"late\": " << late
            << ", \"lost\": " << lost << ", \"failed\": " << failed << "}\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 7 || argc % 2 == 0) return 2;
  std::vector<Target> targets;
  for (int i = 5; i + 1 < argc; i += 2) {
    targets.push_back({argv[i], static_cast<uint32_t>(std::atoi(argv[i + 1]))});
  }
  Crowd crowd(static_cast<size_t>(std::atoi(argv[2])));
  for (size_t i = 0; i < crowd.size(); ++i) {
    crowd[i] =
        std::make_unique<CrowdClient>(argv[1], targets[i % targets.size()], std::atof(argv[4]));
  }
  std::cout << "ready" << std::endl;
  StrikeInTurn(std::atof(argv[3]), crowd);
  PrintCounts(crowd);
  return 0;
}
