// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client_sdk/cli/output/message_json.h"

namespace carillon::cli {

/// Exit codes of the program.
enum ExitCode { kDone = 0, kRefused = 1, kUsage = 2, kNoServer = 3 };

/// Flushes stdout. Errors: Internal (OUTPUT_NOT_WRITABLE: a part of the output is lost).
absl::Status FlushOutput();

/// Prints "carillon: REASON: message" to stderr if `status` is an error, and with `json` to stdout
/// what ErrorJson returns, except for NOT_SERVING, whose findings are printed already. Returns the
/// exit code.
int Report(const absl::Status& status, bool json = false);

/// Returns an error as {"error": {...}} with the members of ErrorInfo: its reason, its message, its
/// figures ("metadata") and its remedies.
std::string ErrorJson(const absl::Status& status);

/// Prints `message` to stdout as one line of JSON; see MessageJson.
void PrintJson(const google::protobuf::Message& message);

/// Prints an object with the members to stdout as one line of JSON; see MembersJson.
void PrintJson(const std::vector<JsonMember>& members);

/// Returns the bytes of a file. Errors: NotFound (FILE_NOT_FOUND).
absl::StatusOr<std::string> ReadText(const std::string& path);

/// Writes a file. Errors: Internal (OUTPUT_NOT_WRITABLE).
absl::Status WriteText(const std::string& path, absl::string_view text);

/// Prints to stderr that a list has no entry of the kind `noun`, so that stdout stays empty.
void PrintNothing(absl::string_view noun);

/// Returns a number with its noun, such as "1 mode", "2 modes" or "0 meshes".
std::string Counted(uint64_t count, absl::string_view noun);

/// Returns a linear amplitude (full scale is 1) as text, such as "-6.0 dBFS". An amplitude
/// below half of the smallest step of 24 bits is "silence".
std::string Decibels(double amplitude);

/// Returns a loudness as text, such as "-23.0 LUFS", or "below -70 LUFS" if it is absent. The
/// standard (ITU-R BS.1770) leaves out all sound below -70 LUFS.
std::string Loudness(bool present, double lufs);

}  // namespace carillon::cli
