// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/command_words.h"

#include <array>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace carillon::cli {
namespace {

struct Translation {
  absl::string_view contract, command;
};

/// The longer one of two texts that begin with the same words comes first.
constexpr auto kTranslations = std::to_array<Translation>({
    {"make one with SceneService.CreateScene", "name one that `carillon scene list` shows"},
    {"make a scene with SceneService.CreateScene", "name a scene of your own"},
    {"(UpdateModalModel, carillon model tag --material)", "by `carillon model tag --material`"},
    {"ask for it with CreateTransfer and let its job succeed",
     "compute it by `carillon transfer create --wait`"},
    {"CreateTransfer", "`carillon transfer create`"},
    {"in the metadata \"authorization: Bearer TOKEN\"", "with --token-file"},
    {"show a client certificate that it names",
     "show a client certificate that it names with --tls-certificate"},
    {"or name another address", "or name another address with --server"},
    {"name a preset to start from", "name a --material to start from"},
    {"accuracy_db", "--accuracy"},
    {"alpha1_s", "--alpha1"},
    {"alpha2_per_s", "--alpha2"},
    {"budget_s", "--budget"},
    {"channel_count", "--channels"},
    {"check_with", "--check-with"},
    {"density_kg_per_m3", "--density"},
    {"full_scale_pa", "--full-scale-pa"},
    {"keep_mode_count", "--keep"},
    {"loss_factor.frequency_hz", "a frequency of --loss-factor"},
    {"loss_factor.loss_factor", "a value of --loss-factor"},
    {"loss_factor", "--loss-factor"},
    {"mass_matrix", "--mass"},
    {"max_frequency_error", "--max-frequency-error"},
    {"mesh_format", "--format"},
    {"metres_per_unit", "--unit"},
    {"page_size", "--page-size"},
    {"page_token", "--page-token"},
    {"poisson_ratio", "--poisson"},
    {"sample_rate_hz", "--sample-rate"},
    {"tail_s", "--tail"},
    {"target_node_count", "--nodes"},
    {"time_limit_s", "--time-limit"},
    {"wall_m", "--wall"},
    {"young_pa", "--young"},
});

/// Whether a word or a path goes on with the character, or a quotation begins or ends with it.
bool Continues(char c) { return absl::ascii_isalnum(c) || c == '_' || c == '/' || c == '"'; }

bool Fits(const Translation& known, const HasOption& has_option) {
  const size_t dashes = known.command.find("--");
  if (known.command.find('`') != absl::string_view::npos || dashes == absl::string_view::npos) {
    return true;  // names a whole command
  }
  return has_option(
      std::string(known.command.substr(dashes, known.command.find(' ', dashes) - dashes)));
}

/// Returns the translation of the words with which `rest` begins, or null if there is none.
const Translation* TranslationAt(absl::string_view rest, const HasOption& has_option) {
  for (const Translation& known : kTranslations) {
    if (!absl::StartsWith(rest, known.contract)) continue;
    const absl::string_view after = rest.substr(known.contract.size());
    const bool ends = after.empty() || !Continues(after.front());
    if (ends && Fits(known, has_option)) return &known;
  }
  return nullptr;
}

}  // namespace

std::string InCommandWords(absl::string_view message, const HasOption& has_option) {
  std::string text;
  while (!message.empty()) {
    const bool begins = text.empty() || (!Continues(text.back()) && text.back() != '.');
    const Translation* const known = begins ? TranslationAt(message, has_option) : nullptr;
    absl::StrAppend(&text, known == nullptr ? message.substr(0, 1) : known->command);
    message.remove_prefix(known == nullptr ? 1 : known->contract.size());
  }
  return text;
}

}  // namespace carillon::cli
