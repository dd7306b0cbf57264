// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/journal_fields.h"

#include <sys/stat.h>

#include <cstdlib>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace carillon {
namespace {

/// The priority of syslog(3).
int PriorityOf(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return 7;
    case LogLevel::kInfo:
      return 6;
    case LogLevel::kWarning:
      return 4;
    case LogLevel::kError:
      break;
  }
  return 3;
}

}  // namespace

bool IsJournal(int descriptor) {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat file {};
  return stream != nullptr && fstat(descriptor, &file) == 0 &&
         stream == absl::StrCat(file.st_dev, ":", file.st_ino);
}

std::vector<std::string> JournalFields(LogLevel level, const std::string& line) {
  return {absl::StrCat("MESSAGE=", line), absl::StrCat("PRIORITY=", PriorityOf(level)),
          "SYSLOG_IDENTIFIER=carillond"};
}

std::vector<std::string> JournalFields(const Event& event) {
  std::vector<std::string> fields = JournalFields(event.level(), event.ToLine());
  fields.push_back(absl::StrCat("CARILLON_EVENT=", event.name()));
  for (const auto& [key, value] : event.fields()) {
    fields.push_back(absl::StrCat("CARILLON_", absl::AsciiStrToUpper(key), "=", value));
  }
  return fields;
}

}  // namespace carillon
