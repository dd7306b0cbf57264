// SPDX-License-Identifier: Apache-2.0
// Reads the input as an access file, and looks its whole text up as a token and as a name.
#include <sys/stat.h>

#include <cstdint>
#include <string>

#include "server/api/edge/access/access_table.h"
#include "tests/fuzz/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const carillon::MemoryFile file(data, size);
  fchmod(file.descriptor(), 0600);
  const auto table = carillon::AccessTable::Read(file.path());
  if (!table.ok()) return 0;
  const std::string text(reinterpret_cast<const char*>(data), size);
  table->FindToken(text);
  table->FindCertificate({text});
  return 0;
}
