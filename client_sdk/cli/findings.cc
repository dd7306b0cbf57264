// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/findings.h"

#include <nlohmann/json.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/str_format.h"

namespace carillon::cli {

std::string Findings::ToText() const {
  std::string text;
  for (const Finding& finding : findings_) {
    absl::StrAppendFormat(&text, "%-5s  %-10s  %s\n", finding.verdict, finding.subject,
                          finding.text);
  }
  return text;
}

std::string Findings::ToJson() const {
  using Json = nlohmann::ordered_json;
  Json json = {{"fault_count", fault_count_}, {"findings", Json::array()}};
  for (const Finding& finding : findings_) {
    const std::string verdict =
        finding.verdict == "?" ? "UNKNOWN" : absl::AsciiStrToUpper(finding.verdict);
    json["findings"].push_back(
        {{"subject", finding.subject}, {"verdict", verdict}, {"text", finding.text}});
  }
  // A device's name may have any bytes.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace carillon::cli
