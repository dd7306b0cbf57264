// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "carillon/v1/server_service.grpc.pb.h"
#include "server/api/edge/access/certificate_end.h"
#include "server/base/clock.h"
#include "server/decomposition/decomposition_queue.h"
#include "server/live_output/live_output.h"

namespace carillon {

/// The settings of the API that GetServerInfo returns.
struct ServerFacts {
  std::string version;
  double client_share = 0;
  double scene_grace_s = 0;
  const CertificateEnd& certificate_end;
  bool binaural = false;                ///< whether a measured head is there
  bool slurm = false;                   ///< whether decompositions run on a cluster
  std::function<bool()> can_decompose;  ///< called on any thread
};

/// carillon.v1.ServerService. The objects that the constructor gets by reference must outlive the
/// service. The daemon's uptime, which the service reports, counts from the construction of the
/// service.
class ServerService final : public v1::ServerService::CallbackService {
 public:
  ServerService(ServerFacts facts, const DecompositionQueue& decompositions,
                const LiveOutput& output, const Clock& clock)
      : facts_(std::move(facts)),
        decompositions_(decompositions),
        output_(output),
        clock_(clock),
        started_unix_ms_(clock.UnixMs()),
        started_(clock.Monotonic()) {}

  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context,
                                          const v1::GetServerInfoRequest* request,
                                          v1::GetServerInfoResponse* response) override;

 private:
  void DescribeFeatures(v1::GetServerInfoResponse& info) const;
  void DescribeLimits(v1::ServerLimits& limits) const;

  const ServerFacts facts_;
  const DecompositionQueue& decompositions_;
  const LiveOutput& output_;
  const Clock& clock_;
  const int64_t started_unix_ms_;
  const std::chrono::nanoseconds started_;
};

}  // namespace carillon
