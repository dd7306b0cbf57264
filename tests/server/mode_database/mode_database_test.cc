// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/mode_database.h"

#include <vector>

#include "carillon/v1/modal_model_service.pb.h"
#include "server/mode_database/utf8_prefix.h"
#include "tests/server/mode_database/database_fixture.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using ModeDatabaseTest = DatabaseTest;

TEST_F(ModeDatabaseTest, AnImportThatEndsEarlyLeavesNothing) {
  auto import = *database_->models().Import(a_, "");
  const auto records = SampleRecords(SampleModel(2, 4));
  for (size_t i = 0; i + 1 < records.size(); ++i) ASSERT_TRUE(import.Append(records[i]).ok());
  EXPECT_THAT(import.Finish().status().ToString(), HasSubstr("MODAL_MODEL_MALFORMED"));
  EXPECT_THAT(database_->models().Find(a_).status().ToString(), HasSubstr("MODAL_MODEL_NOT_FOUND"));
}

TEST_F(ModeDatabaseTest, ARefusedFileLeavesTheOldRevision) {
  ASSERT_TRUE(PutModel(a_, SampleModel(2, 4)).ok());
  auto records = SampleRecords(SampleModel(3, 4));
  (*records.back().mutable_chunk()->mutable_data())[0] ^= 1;
  WriteRecords(folder_ / "bad", records);
  EXPECT_THAT(database_->models().PutFile(a_, "", folder_ / "bad").status().ToString(),
              HasSubstr("MODAL_MODEL_CORRUPT"));
  const auto found = *database_->models().Find(a_);
  EXPECT_EQ(found->mode_count(), 2U);
}

TEST_F(ModeDatabaseTest, AFlippedBitInAnArrayIsFoundWhenTheModelIsExportedOrRead) {
  ModalModel model = SampleModel(3, 4);
  model.couplings = {1.234567890123, 2.345678901234, 3.456789012345};
  ASSERT_TRUE(PutModel(a_, model).ok());
  FlipABitWithin({reinterpret_cast<const char*>(model.couplings.data()), 24});
  auto records = *database_->models().Export(a_);
  absl::Status status;
  for (int i = 0; status.ok() && i < 10; ++i) status = records.Next().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  Reopen();  // without the quarantine of the export
  const auto found = database_->models().Find(a_);
  EXPECT_EQ(found.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(found.status().ToString(), HasSubstr("MODAL_MODEL_CORRUPT"));
  EXPECT_EQ(database_->models().Summary(a_).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(ModeDatabaseTest, AFlippedBitInAMeshIsFoundWhenItIsWrittenOut) {
  const auto mesh = *database_->meshes().Put("solid of revolution");
  FlipABitWithin("solid of revolution");
  EXPECT_THAT(database_->meshes().WriteFile(mesh.digest, folder_ / "mesh").ToString(),
              HasSubstr("DATABASE_CORRUPT"));
}

TEST_F(ModeDatabaseTest, ANewerSchemaIsRefused) {
  database_.reset();
  std::string content = ReadBytes(file_);
  content[63] = 99;  // the last byte of user_version in SQLite's file header
  WriteBytes(file_, content);
  const auto opened = ModeDatabase::Open(file_, clock_);
  EXPECT_EQ(opened.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(opened.status().ToString(), HasSubstr("SCHEMA_TOO_NEW: the database has schema "
                                                    "version 99"));
}

TEST_F(ModeDatabaseTest, AReplacedModelIsReadAnewAndKeepsItsLabel) {
  ASSERT_TRUE(PutModel(a_, SampleModel(2, 4), "first").ok());
  const auto old = database_->models().Find(a_);
  ASSERT_TRUE(PutModel(a_, SampleModel(3, 4), "second").ok());
  EXPECT_EQ(database_->models().Find(a_).value()->mode_count(), 3U);
  EXPECT_EQ((*old)->mode_count(), 2U);
  EXPECT_EQ(database_->models().Summary(a_)->label, "first");
}

TEST_F(ModeDatabaseTest, AnExportOfAReplacedModelSaysSo) {
  ASSERT_TRUE(PutModel(a_, SampleModel(2, 4)).ok());
  auto records = *database_->models().Export(a_);
  ASSERT_TRUE(records.Next().ok());
  ASSERT_TRUE(PutModel(a_, SampleModel(3, 4)).ok());
  EXPECT_THAT(records.Next().status().ToString(), HasSubstr("MODAL_MODEL_REPLACED"));
}

TEST_F(ModeDatabaseTest, DeletingAModelDeletesItsJob) {
  ASSERT_TRUE(PutModel(a_, SampleModel(2, 4)).ok());
  ASSERT_TRUE(database_->jobs().Put({.digest = a_}).ok());
  ASSERT_TRUE(database_->models().Delete(a_).ok());
  EXPECT_THAT(database_->models().Find(a_).status().ToString(), HasSubstr("MODAL_MODEL_NOT_FOUND"));
  EXPECT_FALSE(database_->jobs().Find(a_)->has_value());
  EXPECT_THAT(database_->models().Delete(a_).ToString(), HasSubstr("MODAL_MODEL_NOT_FOUND"));
}

TEST_F(ModeDatabaseTest, ListsTheModelsThatMatchEveryFieldOfAFilter) {
  ASSERT_TRUE(PutModel(a_, SampleModel(2, 4), "Church Bell").ok());
  ASSERT_TRUE(PutModel(b_, SampleModel(50, 400), "glass").ok());
  ASSERT_TRUE(database_->models().Update(b_, {.add_tags = {"fragile", "set:2"}}).ok());
  const auto listed = [&](const ModelFilter& filter) {
    std::string labels;
    const auto page = database_->models().List(filter, 0, "");
    for (const ModelSummary& model : page->models) labels += model.label + ";";
    return labels;
  };
  const int64_t size = static_cast<int64_t>(database_->models().Summary(b_)->stored_bytes);
  EXPECT_EQ(listed({}), "glass;Church Bell;");
  EXPECT_EQ(listed({.label_contains = "bell"}), "Church Bell;");
  EXPECT_EQ(listed({.tag = "fragile"}), "glass;");
  EXPECT_EQ(listed({.label_contains = "bell", .tag = "fragile"}), "");
  EXPECT_EQ(listed({.min_stored_bytes = size}), "glass;");
  EXPECT_EQ(listed({.max_stored_bytes = size - 1}), "Church Bell;");
  EXPECT_EQ(listed({.created_before_unix_ms = 1}), "");
  EXPECT_EQ(listed({.created_since_unix_ms = clock_.UnixMs() + 60'000}), "");
  ASSERT_TRUE(database_->models().Update(b_, {.remove_tags = {"fragile", "none"}}).ok());
  EXPECT_EQ(listed({.tag = "fragile"}), "");
  EXPECT_THAT(database_->models().List({}, 2, "x").status().ToString(),
              HasSubstr("INVALID_SETTINGS"));
  EXPECT_THAT(database_->models().Update(b_, {.add_tags = {"two words"}}).status().ToString(),
              HasSubstr("INVALID_SETTINGS"));
  EXPECT_THAT(database_->models().Update(Sha256Hex("c"), {}).status().ToString(),
              HasSubstr("MODAL_MODEL_NOT_FOUND"));
}

TEST_F(ModeDatabaseTest, CollectionTakesTheLeastRecentlySoundedAndNeverThePinned) {
  const std::string c = Sha256Hex("c"), d = Sha256Hex("d");
  for (const std::string& digest : {a_, b_, c, d}) {
    ASSERT_TRUE(PutModel(digest, SampleModel(10, 100)).ok());
  }
  const uint64_t size = database_->models().Summary(a_)->stored_bytes;
  ASSERT_TRUE(database_->models().Update(a_, {.pinned = true}).ok());
  ASSERT_TRUE(database_->models().FindToSound(b_).ok());
  EXPECT_EQ(database_->models().Summary(a_)->sounded_unix_ms, 0);
  EXPECT_GT(database_->models().Summary(b_)->sounded_unix_ms, 0);
  EXPECT_GT(database_->models().List({}, 10, "")->models[2].sounded_unix_ms, 0);
  const auto sounds = database_->models().Find(c);
  EXPECT_EQ(database_->models().Collect(4 * size)->model_count, 0U);
  const auto first = *database_->models().Collect(3 * size);
  EXPECT_EQ(first.model_count, 1U);
  EXPECT_EQ(first.bytes, size);
  EXPECT_FALSE(database_->models().Find(d).ok()) << "stored after all others, but b sounded since";
  EXPECT_EQ(database_->models().Collect(0)->model_count, 1U) << "b; a is pinned, c in memory";
  EXPECT_TRUE(database_->models().Find(a_).ok());
  EXPECT_TRUE(database_->models().Find(c).ok());
}

TEST_F(ModeDatabaseTest, AModelJustStoredStaysUntilANewerOneNeedsTheRoom) {
  database_->models().KeepWithin({.bytes = 1});
  ASSERT_TRUE(PutModel(a_, SampleModel(10, 100)).ok());
  EXPECT_TRUE(database_->models().Find(a_).ok()) << "though it alone is beyond the budget";
  ASSERT_TRUE(PutModel(a_, SampleModel(20, 100)).ok());
  EXPECT_TRUE(database_->models().Find(a_).ok()) << "its next revision, too";
  auto import = *database_->models().Import(b_, "");
  for (const v1::ModalModelRecord& record : SampleRecords(SampleModel(10, 100))) {
    ASSERT_TRUE(import.Append(record).ok());
  }
  ASSERT_TRUE(import.Finish().ok());
  EXPECT_TRUE(absl::IsNotFound(database_->models().Find(a_).status()));
  EXPECT_TRUE(database_->models().Find(b_).ok());
}

/// A clock that stands where it is set.
class StandingClock final : public Clock {
 public:
  std::chrono::nanoseconds Monotonic() const noexcept override { return {}; }
  int64_t UnixMs() const noexcept override { return unix_ms; }
  int64_t unix_ms = 1;
};

TEST_F(ModeDatabaseTest, AMeshThatNothingRefersToGoesADayAfterItsLastUpload) {
  StandingClock clock;
  database_.reset();
  database_ = *ModeDatabase::Open(file_, clock);
  MeshStore& meshes = database_->meshes();
  const StoredMesh of_model = *meshes.Put("the mesh of a model");
  const StoredMesh of_job = *meshes.Put("the mesh of a job");
  const StoredMesh unused = *meshes.Put("nobody's mesh");
  std::vector<v1::ModalModelRecord> records = SampleRecords(SampleModel(3, 10));
  records.front().mutable_header()->set_mesh_digest(of_model.digest);
  WriteRecords(folder_ / "model", records);
  ASSERT_TRUE(database_->models().PutFile(a_, "", folder_ / "model").ok());
  v1::CreateModalModelRequest request;
  request.set_mesh_digest(of_job.digest);
  ASSERT_TRUE(database_->jobs().Put({.digest = b_, .request = request.SerializeAsString()}).ok());

  const int64_t day_ms = std::chrono::milliseconds(MeshStore::kUnusedLife).count();
  clock.unix_ms = day_ms;
  ASSERT_TRUE(meshes.Put("nobody's mesh").ok());
  clock.unix_ms = 2 * day_ms - 1;
  EXPECT_EQ(meshes.Collect()->mesh_count, 0U) << "it was uploaded again";
  clock.unix_ms = 2 * day_ms;
  const auto collected = *meshes.Collect();
  EXPECT_EQ(collected.mesh_count, 1U);
  EXPECT_EQ(collected.bytes, unused.byte_count);
  EXPECT_TRUE(absl::IsNotFound(meshes.Find(unused.digest).status()));
  EXPECT_TRUE(meshes.Find(of_model.digest).ok());
  EXPECT_TRUE(meshes.Find(of_job.digest).ok());
}

TEST_F(ModeDatabaseTest, AMeshSentInPiecesComesBackWhole) {
  std::string bytes;
  for (int i = 0; i < 600'000; ++i) bytes += "v 1 ";
  auto upload = *database_->meshes().Begin();
  for (size_t at = 0; at < bytes.size(); at += 100'001) {
    ASSERT_TRUE(upload.Append(std::string_view(bytes).substr(at, 100'001)).ok());
  }
  const auto mesh = *upload.Finish();
  EXPECT_EQ(mesh.digest, Sha256Hex(bytes));
  EXPECT_EQ(mesh.byte_count, bytes.size());
  ASSERT_TRUE(database_->meshes().WriteFile(mesh.digest, folder_ / "mesh").ok());
  EXPECT_EQ(ReadBytes(folder_ / "mesh"), bytes);
  EXPECT_EQ(std::filesystem::status(folder_ / "mesh").permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_TRUE(database_->meshes().Put(bytes).ok()) << "twice is no error";
}

TEST_F(ModeDatabaseTest, UnfinishedJobsComeBackInTheOrderTheyWereAskedFor) {
  v1::ErrorInfo error;
  error.set_reason("MESH_NOT_CLOSED");
  const std::string c = Sha256Hex("c");
  auto& jobs = database_->jobs();
  ASSERT_TRUE(jobs.Put({.digest = b_, .state = v1::JOB_STATE_QUEUED}).ok());
  ASSERT_TRUE(jobs.Put({.digest = a_, .state = v1::JOB_STATE_QUEUED}).ok());
  ASSERT_TRUE(jobs.Put({.digest = b_, .state = v1::JOB_STATE_RUNNING}).ok());
  ASSERT_TRUE(
      jobs.Put({.digest = c, .state = v1::JOB_STATE_FAILED, .error = error, .remembered = true})
          .ok());
  Reopen();
  std::vector<std::string> digests;
  const auto unfinished = *database_->jobs().Unfinished();
  digests.reserve(unfinished.size());
  for (const JobRecord& job : unfinished) digests.push_back(job.digest);
  EXPECT_THAT(digests, ElementsAre(b_, a_));
  const auto failed = database_->jobs().Find(c);
  ASSERT_TRUE(failed.ok() && failed->has_value());
  EXPECT_TRUE((*failed)->remembered);
  EXPECT_EQ((*failed)->error.reason(), "MESH_NOT_CLOSED");
  const auto page = *database_->jobs().List(2, "");
  ASSERT_EQ(page.jobs.size(), 2U);
  EXPECT_EQ(page.jobs[0].digest, c);
  EXPECT_EQ(database_->jobs().List(2, page.next_page_token)->jobs[0].digest, b_);
}

TEST(Utf8Prefix, TextThatFitsStaysAndALetterThatIsCutIsLeftOut) {
  for (const char* text : {"", "bell", "Glöckchen", "鐘", "🔔"}) {
    EXPECT_EQ(Utf8Prefix(text, 20), text);
  }
  EXPECT_EQ(Utf8Prefix("aö", 2), "a");
  EXPECT_EQ(Utf8Prefix("a鐘", 3), "a");
  EXPECT_EQ(Utf8Prefix("a鐘", 4), "a鐘");
  for (const size_t max_bytes : {1U, 2U, 3U}) EXPECT_EQ(Utf8Prefix("🔔", max_bytes), "");
  EXPECT_EQ(Utf8Prefix("ab", 1), "a");
  EXPECT_EQ(Utf8Prefix("bell \xE9\x90", 200), "bell ") << "the text ends within a letter";
  EXPECT_EQ(Utf8Prefix("\x90\x90", 200), "");
}

}  // namespace
}  // namespace carillon
