// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

#include "server/api/edge/idle_calls.h"
#include "server/base/clock.h"

namespace carillon {

/// Returns the services grpc.reflection.v1 and grpc.reflection.v1alpha, with which tools list the
/// services and read their contract without the .proto files. They list `names`, the full names of
/// the other services, and themselves.
///
/// gRPC's own reflection service keeps a thread for each open call, however many calls a client
/// opens. These services keep none. They answer the requests of a call one after the other, each
/// with the requested file and all the files that it imports. Open calls are added to `idle_calls`,
/// which must outlive the services as `clock` must.
std::vector<std::unique_ptr<grpc::Service>> MakeReflectionServices(std::vector<std::string> names,
                                                                   IdleCalls& idle_calls,
                                                                   const Clock& clock);

}  // namespace carillon
