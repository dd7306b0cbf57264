// SPDX-License-Identifier: Apache-2.0
//
// A mesh file in one piece, with the data of the files beside it.
#include "proto/cpp/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class MeshFile : public testing::Test {
 protected:
  MeshFile() { std::filesystem::create_directories(folder_ / "data"); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string Write(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return (folder_ / name).string();
  }

  std::string ReadGltf(const std::string& document) {
    const auto bytes = ReadMeshFile(Write("body.gltf", document), "gltf");
    return bytes.ok() ? *bytes : bytes.status().ToString();
  }

  static std::string Gltf(const std::string& uri) {
    return absl::StrCat(R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 3, "uri": ")",
                        uri, R"("}]})");
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) /
      testing::UnitTest::GetInstance()->current_test_info()->name();
};

constexpr char kAbc[] = "data:application/octet-stream;base64,YWJj";

TEST_F(MeshFile, AGltfComesWithTheDataOfItsBuffers) {
  Write("data/of body.bin", "abc");
  const std::string bytes = ReadGltf(Gltf("data/of%20body.bin"));
  EXPECT_THAT(bytes, AllOf(HasSubstr(kAbc), HasSubstr("byteLength"), HasSubstr("2.0")));
  EXPECT_THAT(ReadGltf("\xEF\xBB\xBF" + Gltf("data/of%20body.bin")), HasSubstr(kAbc))
      << "with a byte order mark";
}

TEST_F(MeshFile, AGltfWithAllDataAndATextThatIsNoneStayAsTheyAre) {
  for (const std::string& bytes :
       {Gltf(kAbc), std::string("no JSON {"), std::string(R"({"buffers": 3})"),
        std::string(R"({"buffers": [3, {"uri": 4}, {}]})"), std::string("[1]")}) {
    EXPECT_EQ(ReadGltf(bytes), bytes);
  }
}

TEST_F(MeshFile, ABufferOutsideTheFolderIsRefused) {
  for (const char* uri : {"/etc/passwd", "../passwd", "data/../../passwd", "%2e%2e/passwd",
                          "%2Fetc%2Fpasswd", "file:///etc/passwd", "https://there/body.bin"}) {
    EXPECT_THAT(ReadGltf(Gltf(uri)), AllOf(HasSubstr("MESH_UNREADABLE: "), HasSubstr(uri)));
  }
}

TEST_F(MeshFile, AMissingBufferIsNamed) {
  EXPECT_THAT(ReadGltf(Gltf("data/body.bin")),
              AllOf(HasSubstr("FILE_NOT_FOUND: "), HasSubstr((folder_ / "data/body.bin").string()),
                    HasSubstr("No such file")));
}

TEST_F(MeshFile, OnlyAFileNamedGltfBringsOthers) {
  Write("body.bin", "abc");
  const std::string document = Gltf("body.bin");
  EXPECT_EQ(*ReadMeshFile(Write("mesh", document), "gltf"), document);
  EXPECT_EQ(*ReadMeshFile(Write("body.gltf", document), "obj"), document);
}

TEST_F(MeshFile, AnInputOfAbaqusComesWithTheFilesThatItIncludes) {
  Write("data/corners.inc", "1, 0, 0, 0\n*Include, input=\"data/more.inc\"\n");
  Write("data/more.inc", "2, 1, 0, 0");
  const std::string deck =
      "*NODE, INPUT = data\\corners.inc, NSET=all\r\n** *INCLUDE, INPUT=no\n*STEP\n";
  EXPECT_EQ(*ReadMeshFile(Write("bar.inp", deck), "inp"),
            "*NODE, NSET=all\n**@ 1 data/corners.inc\n1, 0, 0, 0\n**@ 1 data/more.inc\n2, 1, 0, 0\n"
            "**@ 3 data/corners.inc\n\n**@ 2 \n** *INCLUDE, INPUT=no\n*STEP\n\n");
}

TEST_F(MeshFile, AnIncludedFileMustBeThereInTheFolderAndNotIncludeItself) {
  const auto refusal = [&](const std::string& deck) {
    return ReadMeshFile(Write("bar.inp", deck), "inp").status().ToString();
  };
  EXPECT_THAT(refusal("\n*INCLUDE, INPUT=../bar.inc\n"),
              AllOf(HasSubstr("MESH_UNREADABLE: "), HasSubstr("line 2"), HasSubstr("../bar.inc")));
  EXPECT_THAT(refusal("*INCLUDE, INPUT=/etc/passwd\n"), HasSubstr("MESH_UNREADABLE: "));
  EXPECT_THAT(refusal("*INCLUDE, INPUT=gone.inc\n"),
              AllOf(HasSubstr("FILE_NOT_FOUND: "), HasSubstr("gone.inc")));
  EXPECT_THAT(refusal("*INCLUDE, INPUT=bar.inp\n"),
              AllOf(HasSubstr("MESH_UNREADABLE: "), HasSubstr("without an end")));
}

TEST_F(MeshFile, TheTwoFilesOfTetgenBecomeOneAlsoIfTheirNamesAreInCapitals) {
  for (const auto& [first, second] :
       {std::pair("body.node", "body.ele"), {"BODY.NODE", "BODY.ELE"}}) {
    const std::string nodes = Write(first, "nodes");
    const std::string elements = Write(second, "elements\n");
    EXPECT_EQ(*ReadMeshFile(nodes, "node"), "nodes\nelements\n");
    EXPECT_EQ(*ReadMeshFile(elements, "node"), "nodes\nelements\n");
    std::filesystem::remove(elements);
    EXPECT_EQ(*ReadMeshFile(nodes, "node"), "nodes");
  }
}

TEST_F(MeshFile, WhatIsNoFileOrEmptyIsRefused) {
  EXPECT_THAT(ReadMeshFile(folder_.string(), "obj").status().ToString(),
              AllOf(HasSubstr("FILE_NOT_FOUND: "), HasSubstr("Is a directory")));
  EXPECT_THAT(ReadMeshFile(Write("empty.obj", ""), "obj").status().ToString(),
              HasSubstr("MESH_EMPTY: "));
}

}  // namespace
}  // namespace carillon
