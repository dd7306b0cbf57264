// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

namespace carillon {

/// Returns the services grpc.reflection.v1 and grpc.reflection.v1alpha, with which tools list the
/// services and read their contract without the .proto files. They list `names`, the full names of
/// the other services, and themselves.
///
/// gRPC's own reflection service of 1.51 has v1alpha only, and keeps a thread for each open call,
/// however many calls a client opens. These services keep none. They answer the requests of a call
/// one after the other, each with the requested file and all the files that it imports.
std::vector<std::unique_ptr<grpc::Service>> MakeReflectionServices(std::vector<std::string> names);

}  // namespace carillon
