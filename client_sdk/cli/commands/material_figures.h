// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"

namespace carillon::cli {

/// A material as the command line gives it: a named material, figures that override those of the
/// named material, or figures alone.
struct MaterialFigures {
  std::string preset;
  std::string file;  ///< a Material as text, which the other figures override; empty: none
  std::vector<std::string> regions;  ///< "REGION=NAME", a named material for each
  std::optional<double> young_pa;
  std::optional<double> poisson_ratio;
  std::optional<double> density_kg_per_m3;
  std::optional<double> alpha1_s;
  std::optional<double> alpha2_per_s;
  std::string loss_factor;  ///< text for ReadLossFactor; empty: none
};

/// Converts the figures to the message of the contract. Errors: InvalidArgument (INVALID_MATERIAL)
/// if the file is no Material, or the loss factor is malformed; NotFound (FILE_NOT_FOUND).
absl::StatusOr<v1::Material> ToMaterial(const MaterialFigures& figures);

/// Returns the name of a material, with the figures that override its own, or the figures alone.
std::string MaterialText(const v1::Material& material);

}  // namespace carillon::cli
