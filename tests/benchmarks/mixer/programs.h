// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace carillon {

using Arguments = std::vector<std::string>;

/// Each prints one JSON object a line and returns the program's exit status.
/// SECONDS of sound a measurement.
int MeasureRinging(const Arguments& arguments);
/// SECONDS of sound a measurement, MODES; without, several numbers of modes.
int MeasureStruck(const Arguments& arguments);
/// SECONDS of sound a measurement.
int MeasureDirected(const Arguments& arguments);
/// SECONDS, IMPULSES_PER_SECOND; without that, three rates.
int MeasureFlood(const Arguments& arguments);
/// Prints the population, one "frequency_hz t60_s amplitude" a line, for other programs. COUNT
/// SEED.
int PrintPopulation(const Arguments& arguments);

}  // namespace carillon
