// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "server/api/services/server_service.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

v1::GetServerInfoResponse InfoFrom(v1::ServerService::Stub& stub) {
  grpc::ClientContext context;
  v1::GetServerInfoResponse info;
  const grpc::Status status = stub.GetServerInfo(&context, {}, &info);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return info;
}

class ServerInfoApi : public ServedDaemon {
 protected:
  ServerInfoApi() : ServedDaemon({.scene_grace_s = 7, .client_share = 0.25}) {}
};

TEST_F(ServerInfoApi, HasVersionAgeAndOutput) {
  const v1::GetServerInfoResponse answer = InfoFrom(*info);
  EXPECT_EQ(answer.version(), "test");
  EXPECT_EQ(answer.sample_rate_hz(), output().format().sample_rate_hz);
  EXPECT_EQ(answer.channel_count(), output().format().channel_count);
  EXPECT_GE(answer.uptime_s(), 0);
  const int64_t age_ms = SystemClock().UnixMs() - answer.started_unix_ms();
  EXPECT_LT(std::abs(static_cast<double>(age_ms) / 1000 - answer.uptime_s()), 60);
  EXPECT_GT(InfoFrom(*info).uptime_s(), answer.uptime_s());
}

TEST_F(ServerInfoApi, HasTheLimitsAndSettingsOfThisDaemon) {
  const v1::ServerLimits limits = InfoFrom(*info).limits();
  EXPECT_EQ(limits.scene_grace_s(), 7);
  EXPECT_EQ(limits.client_share(), 0.25);
  // The rest is what proto/README.md says.
  EXPECT_EQ(limits.scene_count(), 512U);
  EXPECT_EQ(limits.object_count(), 4096U);
  EXPECT_EQ(limits.sounding_mode_count(), 800U);
  EXPECT_EQ(limits.contact_stream_count(), 2048U);
  EXPECT_EQ(limits.listener_count(), 32U);
  EXPECT_EQ(limits.rendering_count(), 8U);
  EXPECT_EQ(limits.waiting_job_count(), 1024U);
  EXPECT_EQ(limits.mesh_bytes(), uint64_t{256} << 20U);
  EXPECT_EQ(limits.page_size(), 1000U);
}

TEST_F(ServerInfoApi, AMessageOfTheLargestSizeIsReadAndOneByteMoreIsNot) {
  v1::CreateModalModelRequest request;
  request.set_label("x");
  const size_t rest = InfoFrom(*info).limits().message_bytes() - request.ByteSizeLong();
  // The length of a label takes two bytes more when it is longer.
  for (const auto& [size, read] : {std::pair(rest - 1, true), std::pair(rest, false)}) {
    request.set_label(std::string(size, 'x'));
    v1::CreateModalModelResponse response;
    const grpc::Status status =
        Call(*models, &v1::ModalModelService::Stub::CreateModalModel, request, response);
    EXPECT_EQ(status.error_code(), read ? grpc::INVALID_ARGUMENT : grpc::RESOURCE_EXHAUSTED)
        << request.ByteSizeLong() << ": " << status.error_message();
  }
}

/// A daemon whose decompositions run on a cluster.
class ClusterInfoApi : public ServedDaemon {
 protected:
  ClusterInfoApi() : ServedDaemon({.slurm = true}) {}
};

TEST_F(ClusterInfoApi, SlurmIsAFeature) {
  const v1::GetServerInfoResponse answer = InfoFrom(*info);
  EXPECT_THAT(answer.features(), testing::Contains("slurm"));
  EXPECT_TRUE(std::ranges::is_sorted(answer.features()));
}

}  // namespace
}  // namespace carillon
