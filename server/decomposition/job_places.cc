// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_places.h"

#include <algorithm>

namespace carillon {

v1::WaitCause JobPlaces::Obstacle(v1::JobKind kind, uint64_t bytes) const {
  if (LacksWorker(kind)) return v1::WAIT_CAUSE_WORKER;
  const bool fits = OccupiedBytes() + bytes <= capacity_.memory_budget_bytes;
  return fits || runs_.empty() ? v1::WAIT_CAUSE_UNSPECIFIED : v1::WAIT_CAUSE_MEMORY;
}

void JobPlaces::Take(const std::string& digest, v1::JobKind kind, uint64_t bytes) {
  runs_[digest] = {.kind = kind, .bytes = bytes, .number = ++last_number_};
}

std::vector<std::string> JobPlaces::ChooseToEnd(uint64_t bytes) {
  uint64_t left_bytes = OccupiedBytes();
  size_t left_count = runs_.size();
  const auto fits = [&] {
    return left_count == 0 || left_bytes + bytes <= capacity_.memory_budget_bytes;
  };
  const auto leave = [&](const Run& run) {
    left_bytes -= run.bytes;
    --left_count;
  };
  std::map<uint64_t, std::string> transfers;  // by number
  for (const auto& [digest, run] : runs_) {
    if (run.ends) leave(run);
    if (!run.ends && run.kind == v1::JOB_KIND_TRANSFER) transfers[run.number] = digest;
  }
  std::vector<std::string> chosen;
  while (!fits() && !transfers.empty()) {
    chosen.push_back(transfers.rbegin()->second);
    transfers.erase(std::prev(transfers.end()));
    leave(runs_.at(chosen.back()));
  }
  if (!fits()) return {};
  for (const std::string& digest : chosen) runs_.at(digest).ends = true;
  return chosen;
}

std::vector<std::string> JobPlaces::Occupants(v1::JobKind kind, v1::WaitCause cause) const {
  const bool by_models_only = cause == v1::WAIT_CAUSE_WORKER && capacity_.transfers_yield &&
                              kind == v1::JOB_KIND_DECOMPOSITION;
  std::vector<std::string> digests;
  for (const auto& [digest, run] : runs_) {
    if (!by_models_only || run.kind == kind) digests.push_back(digest);
  }
  return digests;
}

size_t JobPlaces::CountOf(v1::JobKind kind) const {
  return static_cast<size_t>(
      std::ranges::count_if(runs_, [kind](const auto& run) { return run.second.kind == kind; }));
}

bool JobPlaces::LacksWorker(v1::JobKind kind) const {
  const auto worker_count = static_cast<size_t>(capacity_.worker_count);
  if (!capacity_.transfers_yield) return runs_.size() >= worker_count;
  if (kind == v1::JOB_KIND_DECOMPOSITION) return CountOf(kind) >= worker_count;
  return runs_.size() >= worker_count && CountOf(kind) > 0;
}

uint64_t JobPlaces::OccupiedBytes() const {
  uint64_t bytes = 0;
  for (const auto& [digest, run] : runs_) bytes += run.bytes;
  return bytes;
}

}  // namespace carillon
