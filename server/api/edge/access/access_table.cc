// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/access_table.h"

#include <openssl/crypto.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/edge/access/private_file.h"
#include "server/base/sha256.h"

namespace carillon {
namespace {

constexpr char kUnusable[] = "ACCESS_FILE_UNUSABLE";
constexpr std::array kRoles = {Role::kListen, Role::kStrike, Role::kSubmit, Role::kAdminister};

absl::Status WrongLine(absl::string_view why) {
  return Refusal(absl::StatusCode::kFailedPrecondition, kUnusable, why);
}

absl::StatusOr<unsigned> ParseRoles(absl::string_view text) {
  unsigned roles = 0;
  for (const absl::string_view word : absl::StrSplit(text, ',')) {
    const auto* const role = std::find_if(kRoles.begin(), kRoles.end(),
                                          [word](Role known) { return RoleName(known) == word; });
    if (role == kRoles.end()) {
      return WrongLine("a role is not one of listen, strike, submit and administer");
    }
    roles |= static_cast<unsigned>(*role);
  }
  return roles;
}

bool IsSameDigest(const std::string& a, const std::string& b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace

absl::string_view RoleName(Role role) {
  switch (role) {
    case Role::kListen:
      return "listen";
    case Role::kStrike:
      return "strike";
    case Role::kSubmit:
      return "submit";
    case Role::kAdminister:
      return "administer";
    default:
      return "any";
  }
}

AccessTable AccessTable::ForThisMachine() {
  AccessTable table;
  table.anybody_.name = kLocalCaller;
  for (const Role role : {Role::kListen, Role::kStrike, Role::kSubmit}) {
    table.anybody_.roles |= static_cast<unsigned>(role);
  }
  return table;
}

absl::StatusOr<AccessTable> AccessTable::Read(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string content, ReadPrivateFile(path, kUnusable));
  AccessTable table;
  EarlierLines earlier;
  int number = 0;
  for (const absl::string_view line : absl::StrSplit(content, '\n')) {
    ++number;
    const absl::Status read = table.ReadLine(absl::StripAsciiWhitespace(line), number, earlier);
    if (read.ok()) continue;
    return WrongLine(absl::StrCat(
        path, " line ", number, ": ", ToErrorInfo(read).message(),
        "; write NAME ROLES sha256:DIGEST, NAME ROLES certificate:NAME or anybody ROLES"));
  }
  return table;
}

absl::Status AccessTable::EarlierLines::Check(const std::string& name, unsigned roles,
                                              const std::string& credential, int number) {
  const auto [same_credential, is_new] = by_credential.emplace(credential, number);
  if (!is_new && !credential.empty()) {
    return WrongLine(absl::StrCat("the credential is that of line ", same_credential->second,
                                  ", too: remove one of the two lines"));
  }
  const auto same_name = by_name.emplace(name, std::pair(roles, number)).first;
  const auto [first_roles, first_number] = same_name->second;
  if (first_roles == roles) return absl::OkStatus();
  return WrongLine(absl::StrCat("line ", first_number, " gives \"", name,
                                "\" other roles: give both lines the same ones"));
}

absl::Status AccessTable::ReadLine(absl::string_view line, int number, EarlierLines& earlier) {
  if (line.empty() || line.front() == '#') return absl::OkStatus();
  const std::vector<std::string> words =
      absl::StrSplit(line, absl::ByAnyChar(" \t"), absl::SkipEmpty());
  if (words.size() < 2) return WrongLine("the line has no roles");
  ASSIGN_OR_RETURN(const unsigned roles, ParseRoles(words[1]));
  // The line of anybody has no credential.
  const std::string shown = words.size() > 2 ? words[2] : "";
  RETURN_IF_ERROR(earlier.Check(words[0], roles, shown, number));
  if (words[0] == anybody_.name && words.size() == 2) {
    anybody_.roles = roles;
    return absl::OkStatus();
  }
  if (words.size() != 3 || words[0] == anybody_.name) {
    return WrongLine("the line has not three words");
  }
  Entry entry{.principal = {.name = words[0], .roles = roles}};
  absl::string_view credential = shown;
  if (absl::ConsumePrefix(&credential, "sha256:") && IsSha256Hex(std::string(credential))) {
    entry.token_sha256 = std::string(credential);
  } else if (absl::ConsumePrefix(&credential, "certificate:") && !credential.empty()) {
    entry.certificate_name = std::string(credential);
  } else {
    return WrongLine(
        "the third word is neither sha256: with 64 hexadecimal digits nor certificate:"
        " with a name");
  }
  entries_.push_back(std::move(entry));
  return absl::OkStatus();
}

const Principal* AccessTable::FindToken(const std::string& token) const {
  const std::string digest = Sha256Hex(token);
  const Principal* found = nullptr;
  for (const Entry& entry : entries_) {
    if (IsSameDigest(entry.token_sha256, digest)) found = &entry.principal;
  }
  return found;
}

const Principal* AccessTable::FindCertificate(const std::vector<std::string>& names) const {
  for (const Entry& entry : entries_) {
    if (entry.certificate_name.empty()) continue;
    if (std::find(names.begin(), names.end(), entry.certificate_name) != names.end()) {
      return &entry.principal;
    }
  }
  return nullptr;
}

}  // namespace carillon
