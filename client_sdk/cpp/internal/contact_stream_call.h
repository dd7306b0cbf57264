// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/client_context.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/contact_stream.h"
#include "carillon/v1/contact_service.grpc.pb.h"

namespace carillon::client {

/// Opens StreamContacts on `stub` with the token and the deadline of `context`, and waits for the
/// first answer. Error messages name `server`.
absl::StatusOr<std::unique_ptr<ContactStream>> OpenContactStream(
    v1::ContactService::Stub& stub, const std::string& server,
    std::unique_ptr<grpc::ClientContext> context, const v1::ContactStreamStart& start);

}  // namespace carillon::client
