// SPDX-License-Identifier: Apache-2.0
#include "carillon/contact_trace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <vector>

namespace carillon::client {
namespace {

using testing::HasSubstr;

/// A file of its own for each test, removed at its end.
class ContactTrace : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }

  void WriteExample() {
    v1::ContactTraceHeader header;
    header.set_simulator("test");
    header.set_step_s(0.01);
    auto writer = ContactTraceWriter::Create(path_, header);
    ASSERT_TRUE(writer.ok()) << writer.status();
    v1::ContactTraceObject object;
    object.set_handle(7);
    object.set_modal_model("modalModels/abc");
    writer->Write(object);
    v1::ContactStep step;
    step.set_time_s(0.25);
    // More than 127 bytes, so that its length takes two.
    for (int i = 0; i < 20; ++i) step.add_contacts()->set_object(7);
    ASSERT_TRUE(writer->Write(step).ok());
    ASSERT_TRUE(writer->Close().ok());
  }

  std::string Bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  void Overwrite(const std::string& bytes) const {
    std::ofstream(path_, std::ios::binary) << bytes;
  }

  /// The status that reading to the end gives.
  absl::Status ReadAll() const {
    auto reader = ContactTraceReader::Open(path_);
    if (!reader.ok()) return reader.status();
    while (true) {
      const auto record = reader->Next();
      if (!record.ok()) return record.status();
      if (!*record) return absl::OkStatus();
    }
  }

  const std::string path_ = testing::TempDir() +
                            testing::UnitTest::GetInstance()->current_test_info()->name() +
                            ".contacts";
};

TEST_F(ContactTrace, ReadsBackWhatWasWritten) {
  WriteExample();
  auto reader = ContactTraceReader::Open(path_);
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ(reader->header().simulator(), "test");
  EXPECT_EQ(reader->header().format_version(), 1);
  const auto object = reader->Next();
  ASSERT_TRUE(object.ok() && *object);
  EXPECT_EQ((*object)->object().handle(), 7);
  const auto step = reader->Next();
  ASSERT_TRUE(step.ok() && *step);
  EXPECT_EQ((*step)->step().time_s(), 0.25);
  EXPECT_EQ((*step)->step().contacts_size(), 20);
  EXPECT_FALSE(reader->Next().value());
}

TEST_F(ContactTrace, IsMalformedWhereverItIsCutOffWithinARecord) {
  WriteExample();
  const std::string whole = Bytes();
  int whole_records = 0;
  for (size_t length = 0; length < whole.size(); ++length) {
    Overwrite(whole.substr(0, length));
    const absl::Status status = ReadAll();
    if (status.ok()) {
      ++whole_records;
    } else {
      EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
      EXPECT_THAT(status.ToString(), AllOf(HasSubstr("TRACE_MALFORMED: "), HasSubstr(path_)));
    }
  }
  // Cut between records the file is a shorter trace: after the header, and after the object.
  EXPECT_EQ(whole_records, 2);
}

TEST_F(ContactTrace, RefusesAFormatFromTheFuture) {
  v1::ContactTraceRecord record;
  record.mutable_header()->set_format_version(2);
  const std::string bytes = record.SerializeAsString();
  Overwrite(std::string(1, static_cast<char>(bytes.size())) + bytes);
  EXPECT_THAT(ReadAll().ToString(), HasSubstr("TRACE_TOO_NEW: "));
}

TEST_F(ContactTrace, RefusesAStepWhoseTimeIsTooLargeOrGoesBack) {
  auto writer = ContactTraceWriter::Create(path_, {});
  ASSERT_TRUE(writer.ok()) << writer.status();
  const auto write = [&](double time_s) {
    v1::ContactStep step;
    step.set_time_s(time_s);
    return writer->Write(step).ToString();
  };
  for (const double time_s : {std::nan(""), std::numeric_limits<double>::infinity(), -1.1e10}) {
    EXPECT_THAT(write(time_s), HasSubstr("INVALID_STREAM: "));
  }
  // A simulation may begin at a time below zero, and two steps may have the same time.
  for (const double time_s : {-1.0, 2.0, 2.0}) EXPECT_EQ(write(time_s), "OK");
  EXPECT_THAT(write(1.5), AllOf(HasSubstr("INVALID_STREAM: "),
                                HasSubstr("time goes back from 2 s to 1.5 s at step 3;")));
  EXPECT_EQ(write(3), "OK");
  EXPECT_THAT(write(1e10 + 0.5), HasSubstr("time_s of step 4 is 10000000000.5; "));
  ASSERT_TRUE(writer->Close().ok());
  std::vector<double> times_s;
  auto reader = ContactTraceReader::Open(path_);
  ASSERT_TRUE(reader.ok()) << reader.status();
  for (auto record = reader->Next(); record.value(); record = reader->Next()) {
    times_s.push_back((*record)->step().time_s());
  }
  EXPECT_THAT(times_s, testing::ElementsAre(-1, 2, 2, 3));
}

}  // namespace
}  // namespace carillon::client
