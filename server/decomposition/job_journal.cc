// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_journal.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

constexpr char kCorrectionFact[] = "memory_correction";

}  // namespace

void JobJournal::Note(const JobRecord& record, const std::vector<std::string>& clients) {
  events_.LogUnstored("job", record.digest, Put(record, clients));
}

void JobJournal::NoteCoarseModel(const std::string& from, const std::string& to,
                                 const std::string& label) {
  events_.LogUnstored("coarse_model", to, database_.models().CopyIfAbsent(from, to, label));
}

void JobJournal::NoteExperience(const MemoryExperience& experience) {
  events_.LogUnstored(
      "memory_correction", "",
      database_.jobs().PutFact(kCorrectionFact, absl::StrCat(experience.correction())));
}

MemoryExperience JobJournal::ReadExperience() {
  const auto fact = database_.jobs().Fact(kCorrectionFact);
  double correction = 1;
  const bool known = fact.ok() && fact->has_value() && absl::SimpleAtod(**fact, &correction);
  return known ? MemoryExperience(correction) : MemoryExperience();
}

JobWishes JobJournal::ReadWishes(const std::string& digest) {
  return JobWishes(database_.jobs().Clients(digest).value_or(std::vector<std::string>()));
}

}  // namespace carillon
