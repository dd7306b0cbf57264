// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "server/base/sha256.h"
#include "server/base/xxh3.h"

namespace carillon {
namespace {

// The two examples of FIPS 180-4 for SHA-256.
TEST(Sha256, GivesTheDigestsOfTheStandard) {
  EXPECT_EQ(Sha256Hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256Hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST(Sha256, DoesNotDependOnThePiecesInWhichBytesArrive) {
  const std::string bytes(100'000, 'x');
  Sha256 sha;
  for (size_t at = 0; at < bytes.size(); at += 777) {
    sha.Update(std::string_view(bytes).substr(at, 777));
  }
  EXPECT_EQ(sha.Finish(), Sha256Hex(bytes));
}

TEST(IsSha256Hex, TakesOnlySixtyFourLowerCaseDigits) {
  const std::string digest = Sha256Hex("");
  EXPECT_TRUE(IsSha256Hex(digest));
  EXPECT_FALSE(IsSha256Hex(digest.substr(1)));
  EXPECT_FALSE(IsSha256Hex(std::string(64, 'E')));
  EXPECT_FALSE(IsSha256Hex(std::string(64, '/')));
}

// The published value of XXH3_64bits for no bytes with seed 0.
TEST(Xxh3, GivesThePublishedValueOfNothing) { EXPECT_EQ(Xxh3(""), 0x2D06800538D394C2ULL); }

TEST(Xxh3, SeesAFlippedBitAnywhereInAMebibyte) {
  std::string bytes(1 << 20, '\x5a');
  const uint64_t hash = Xxh3(bytes);
  for (const size_t at : {size_t{0}, size_t{524'287}, bytes.size() - 1}) {
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    EXPECT_NE(Xxh3(bytes), hash);
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
  }
  EXPECT_EQ(Xxh3(bytes), hash);
}

}  // namespace
}  // namespace carillon
