// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/daemon_log.h"

#include <spdlog/details/null_mutex.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <vector>

// The place in the source says nothing to the reader of a log.
#define SD_JOURNAL_SUPPRESS_LOCATION
#include <systemd/sd-journal.h>

#include "server/daemon/journal_fields.h"

namespace carillon {
namespace {

/// Whether messages go to the journal. Set before the first message.
bool uses_journal = false;

/// Returns false if the journal takes nothing.
bool SendToJournal(std::vector<std::string> fields) {
  std::vector<iovec> parts;
  parts.reserve(fields.size());
  for (std::string& field : fields) parts.push_back({field.data(), field.size()});
  return sd_journal_sendv(parts.data(), static_cast<int>(parts.size())) == 0;
}

LogLevel LevelOf(spdlog::level::level_enum level) {
  if (level >= spdlog::level::err) return LogLevel::kError;
  if (level == spdlog::level::warn) return LogLevel::kWarning;
  return level == spdlog::level::info ? LogLevel::kInfo : LogLevel::kDebug;
}

spdlog::level::level_enum LevelOf(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      break;
  }
  return spdlog::level::err;
}

/// Sends the lines that are no events to the journal. Needs no lock, because a call of the journal
/// is one message.
class JournalSink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string line(message.payload.data(), message.payload.size());
    if (!SendToJournal(JournalFields(LevelOf(message.level), line))) stderr_.log(message);
  }

  void flush_() override {}

  spdlog::sinks::stderr_sink_mt stderr_;
};

}  // namespace

void SetUpLog() {
  uses_journal = IsJournal(STDERR_FILENO);
  if (uses_journal) {
    const auto sink = std::make_shared<JournalSink>();
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("carillond", sink));
  } else {
    spdlog::set_default_logger(spdlog::stderr_logger_mt("carillond"));
  }
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l: %v");
  spdlog::flush_on(spdlog::level::debug);
}

void SetLogLevel(const std::string& name) { spdlog::set_level(spdlog::level::from_str(name)); }

void LowerLogLevel(const std::string& name) {
  spdlog::set_level(std::min(spdlog::get_level(), spdlog::level::from_str(name)));
}

void LogEvent(const Event& event) {
  const spdlog::level::level_enum level = LevelOf(event.level());
  if (!spdlog::should_log(level)) return;
  if (uses_journal && SendToJournal(JournalFields(event))) return;
  spdlog::log(level, "{}", event.ToLine());
}

}  // namespace carillon
