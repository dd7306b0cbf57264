// SPDX-License-Identifier: Apache-2.0
// mixer_measure ringing|struck|directed|flood|population [ARGUMENTS...]
#include <hwy/targets.h>

#include <cstdio>
#include <cstdlib>
#include <map>

#include "tests/benchmarks/mixer/programs.h"

int main(int count, char** values) {
  using carillon::Arguments;
  const std::map<std::string, int (*)(const Arguments&)> programs = {
      {"ringing", carillon::MeasureRinging},   {"struck", carillon::MeasureStruck},
      {"flood", carillon::MeasureFlood},       {"population", carillon::PrintPopulation},
      {"directed", carillon::MeasureDirected},
  };
  const auto found = count > 1 ? programs.find(values[1]) : programs.end();
  if (found == programs.end()) {
    std::fprintf(stderr,
                 "usage: mixer_measure ringing|struck|directed|flood|population [ARGUMENTS...]\n");
    return 2;
  }
  // CARILLON_MOST_TARGET=AVX2 renders as a machine without AVX-512 would.
  if (const char* most = std::getenv("CARILLON_MOST_TARGET")) {
    int64_t allowed = 0;
    for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
      if (hwy::TargetName(target) == std::string(most)) allowed = target;
    }
    if (allowed == 0) {
      std::fprintf(stderr, "this machine has no %s\n", most);
      return 2;
    }
    hwy::SetSupportedTargetsForTest(allowed);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
  return found->second(Arguments(values + 2, values + count));
}
