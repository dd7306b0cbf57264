// SPDX-License-Identifier: Apache-2.0
// How libFuzzer changes the inputs of request.cc: mostly a field of a message, sometimes a byte.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "tests/fuzz/message_mutator.h"
#include "tests/fuzz/request_case.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace carillon {
namespace {

using Random = MessageMutator::Random;

std::string Digest(char digit) { return std::string(64, digit); }

const std::vector<std::string>& Words() {
  static const auto* const words = new std::vector<std::string>{"scenes/fuzz",
                                                                "scenes/1",
                                                                "scenes/fuzz/objects/1",
                                                                "modalModels/" + Digest('a'),
                                                                "modalModels/" + Digest('b'),
                                                                "meshes/" + Digest('a'),
                                                                "jobs/1",
                                                                "fuzz",
                                                                "chime_aluminum",
                                                                "glass",
                                                                "obj",
                                                                "60:4",
                                                                "a label",
                                                                "",
                                                                "*",
                                                                std::string(300, 'x')};
  return *words;
}

void ChangeMessages(RequestCase& request, Random& random) {
  if (request.messages.empty() || random() % 8 == 0) {
    request.messages.push_back(request.messages.empty() ? "" : request.messages.back());
  }
  if (random() % 16 == 0) request.messages.pop_back();
  if (request.messages.empty()) return;
  std::string& bytes = request.messages[random() % request.messages.size()];
  const auto message = NewRequest(request.method);
  if (!message->ParseFromString(bytes)) message->Clear();
  MessageMutator mutator(random, Words());
  for (size_t change = random() % 3 + 1; change > 0; --change) mutator.Mutate(*message);
  bytes = message->SerializeAsString();
}

}  // namespace
}  // namespace carillon

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned int seed) {
  using namespace carillon;  // NOLINT(google-build-using-namespace)
  Random random(seed);
  auto request = ParseRequestCase({reinterpret_cast<const char*>(data), size});
  if (request && random() % 8 == 0) return LLVMFuzzerMutate(data, size, max_size);
  if (!request || random() % 16 == 0) {
    request = RequestCase{.method = AllMethods()[random() % AllMethods().size()], .messages = {}};
  }
  ChangeMessages(*request, random);
  const std::string text = ToText(*request);
  if (text.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::memcpy(data, text.data(), text.size());
  return text.size();
}
