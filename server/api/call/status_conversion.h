// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/support/status.h>

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "carillon/v1/error.pb.h"

namespace carillon {

/// Greatest size of the message of a refusal. gRPC's clients take 8 KiB of metadata, in which the
/// message is written three times.
inline constexpr size_t kMostMessageBytes = 1024;

/// Returns text that is safe to send and to print: valid UTF-8 without control characters, of at
/// most `most_bytes`. Other bytes are written as \xNN. A longer text loses its middle.
std::string Legible(std::string_view text, size_t most_bytes = kMostMessageBytes);

/// Returns an error with legible texts, which may repeat what a client sent.
v1::ErrorInfo ToLegibleErrorInfo(const absl::Status& status);

/// Converts `status` to a gRPC status of the same code and a legible message. The details of the
/// gRPC status are a serialized carillon.v1.StatusDetails with reason, message and figures. gRPC
/// sends the details as "grpc-status-details-bin".
grpc::Status ToGrpcStatus(const absl::Status& status);

}  // namespace carillon
