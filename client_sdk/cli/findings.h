// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace carillon::cli {

/// What `carillon doctor` has found, and how it is printed.
class Findings {
 public:
  void Good(const char* subject, const std::string& text) { Add("ok", subject, text); }
  void Bad(const char* subject, const std::string& text) {
    Add("FAULT", subject, text);
    ++fault_count_;
  }
  void Unknown(const char* subject, const std::string& text) { Add("?", subject, text); }
  int fault_count() const { return fault_count_; }

  /// A line for each finding.
  std::string ToText() const;

  /// One line: {"fault_count": 1, "findings": [{"subject": "sound", "verdict": "FAULT", "text":
  /// ...}]}. The verdicts are "OK", "FAULT" and "UNKNOWN".
  std::string ToJson() const;

 private:
  struct Finding {
    std::string verdict;
    std::string subject;
    std::string text;
  };

  void Add(const char* verdict, const char* subject, const std::string& text) {
    findings_.push_back({verdict, subject, text});
  }

  std::vector<Finding> findings_;
  int fault_count_ = 0;
};

}  // namespace carillon::cli
