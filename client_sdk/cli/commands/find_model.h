// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/client.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::cli {

/// Returns the name "modalModels/{digest}" of the model that `text` means: its name, its label, or
/// the first digits of its digest. Errors: NotFound (MODAL_MODEL_NOT_FOUND, with the state of the
/// job that has yet to make the model, if there is one), InvalidArgument (NAME_AMBIGUOUS),
/// and those of Client::ListModalModels.
absl::StatusOr<std::string> FindModel(const client::Client& daemon, const std::string& text);

/// Returns the model that `text` means. Errors: those of FindModel and of Client::GetModalModel.
absl::StatusOr<v1::ModalModelSummary> FindSummary(const client::Client& daemon,
                                                  const std::string& text);

/// Returns the content of the model "modalModels/{digest}". Errors: those of
/// Client::ExportModalModel and of ModelAssembler.
absl::StatusOr<interchange::StoredModel> Fetch(const client::Client& daemon,
                                               const std::string& name);

/// Returns a sentence that says that other models have the label of `model`, too, and how to name
/// each. Returns an empty string if no other model has the label.
std::string SharedLabel(const client::Client& daemon, const v1::ModalModelSummary& model);

/// Returns a sentence that says that a requested model has another label than the wanted one, and
/// what follows from that. Returns an empty string if it has the wanted label.
std::string OtherLabel(const v1::ModalModelSummary& model, const std::string& wanted);

/// Returns the name "jobs/{digest}" of the job that `text` means: its name, its label, or the first
/// digits of its digest. Errors: NotFound (JOB_NOT_FOUND), InvalidArgument
/// (NAME_AMBIGUOUS), and those of Client::ListJobs.
absl::StatusOr<std::string> FindJob(const client::Client& daemon, const std::string& text);

}  // namespace carillon::cli
