// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "carillon/v1/error.pb.h"

namespace carillon {

/// Returns a status of `code` with the message "REASON: message". Every absl::Status that can reach
/// a user through the API is made by this function. proto/errors.md lists the reasons.
absl::Status Refusal(absl::StatusCode code, absl::string_view reason, absl::string_view message);

/// Adds a figure that belongs to the reason, for programs ("first_mode_hz" = "31.5").
void AddFigure(absl::Status& status, absl::string_view name, absl::string_view value);

/// Returns the same refusal with what it is about, "REASON: about: message", and with a figure.
absl::Status About(absl::string_view about, absl::string_view figure, absl::string_view value,
                   const absl::Status& status);

/// Returns the same refusal for element `index` of a list, "REASON: list[index]: message", with the
/// figure "index".
absl::Status AtElement(const absl::Status& status, absl::string_view list, size_t index);

/// Returns the same refusal for the step at simulation time `time_s`, "REASON: at TIME s: message",
/// with the figure "time_s".
absl::Status AtTime(const absl::Status& status, double time_s);

/// Adds a change to the request that may help.
void AddRemedy(absl::Status& status, const v1::Remedy& remedy);

/// Returns a remedy as text for people who type options, such as "--repair: repairs the surface".
std::string RemedyText(const v1::Remedy& remedy);

/// Returns reason, message, figures and remedies of a status. A status without a reason gets
/// "INTERNAL".
v1::ErrorInfo ToErrorInfo(const absl::Status& status);

/// Returns the status that ToErrorInfo would turn into `error`.
absl::Status FromErrorInfo(absl::StatusCode code, const v1::ErrorInfo& error);

}  // namespace carillon
