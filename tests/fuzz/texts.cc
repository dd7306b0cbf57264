// SPDX-License-Identifier: Apache-2.0
// Reads the input as each of the short texts that strangers send: names, page tokens, fixtures,
// quantities and the request of a worker.
#include <cstdint>
#include <string>

#include "proto/cpp/fixture_text.h"
#include "proto/cpp/program/quantity.h"
#include "server/api/convert/resource_name.h"
#include "server/mode_database/page_token.h"
#include "server/mode_database/utf8_prefix.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace carillon;  // NOLINT(google-build-using-namespace)
  const std::string text(reinterpret_cast<const char*>(data), size);
  ParseModelName(text).IgnoreError();
  ParseJobName(text).IgnoreError();
  ParseSceneName(text).IgnoreError();
  ParseObjectName(text).IgnoreError();
  ParsePage("jobs", 10, text).IgnoreError();
  Utf8Prefix(text, 8);
  ParseShare(text);
  ParseBudget(text);
  ParseUnitM(text);
  ParseLengthM(text);
  const auto fixture = ParseFixture(text);
  if (fixture.ok()) FixtureText(*fixture).IgnoreError();
  return 0;
}
