// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/fair_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

TEST(FairQueue, ItsOrderIsThatOfTheStarts) {
  std::mt19937 random(7);
  FairQueue queue;
  for (const char* client : {"a", "b", "c"}) queue.NoteStart(client);
  std::map<std::string, FairQueue::Entry> entries;
  for (uint64_t number = 0; number < 60; ++number) {
    FairQueue::Entry entry{.client = std::string(1, static_cast<char>('a' + random() % 5)),
                           .priority = static_cast<int32_t>(random() % 3),
                           .number = number,
                           .digest = absl::StrCat(number)};
    queue.Add(entry);
    entries[entry.digest] = entry;
  }
  const std::vector<absl::string_view> views = queue.Order();
  const std::vector<std::string> order(views.begin(), views.end());
  std::vector<std::string> starts;
  while (const auto next = queue.Next()) {
    starts.push_back(*next);
    queue.NoteStart(entries.at(*next).client);
    queue.Remove(entries.at(*next));
  }
  EXPECT_EQ(starts.size(), entries.size());
  EXPECT_EQ(order, starts);
}

}  // namespace
}  // namespace carillon
