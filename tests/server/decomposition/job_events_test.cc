// SPDX-License-Identifier: Apache-2.0
//
// What the log tells of jobs.
#include "server/decomposition/job_events.h"

#include "server/base/mutex.h"
#include "tests/server/decomposition/queue_fixture.h"

namespace carillon {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

class JobEventsTest : public DecompositionQueueTest {
 protected:
  JobEventsTest() {
    settings_.log_event = [this](const Event& event) {
      const MutexLock lock(&mutex_);
      lines_.push_back(event.ToLine());
      levels_.push_back(event.level());
    };
  }

  std::vector<std::string> Lines() {
    const MutexLock lock(&mutex_);
    return lines_;
  }

  std::vector<LogLevel> Levels() {
    const MutexLock lock(&mutex_);
    return levels_;
  }

 private:
  Mutex mutex_;
  std::vector<std::string> lines_;
  std::vector<LogLevel> levels_;
};

TEST_F(JobEventsTest, AFailedJobIsAWarningWithItsReason) {
  MakeQueue("exit 1\n");
  v1::CreateModalModelRequest request = Request(20'000);
  request.set_label("my bell");
  Diary diary;
  const auto job = queue_->Submit(request, "robot");
  ASSERT_TRUE(job.ok()) << job.status();
  const auto watch = Watch(*job, diary);
  const v1::Job ended = diary.AwaitEnd();
  ASSERT_EQ(ended.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(Lines(),
              ElementsAre(AllOf(StartsWith("job_failed job=" + job->name() +
                                           " reason=" + ended.error().reason() + " message="),
                                HasSubstr(" label=\"my bell\""), HasSubstr(" client=robot"))));
  EXPECT_THAT(Levels(), ElementsAre(LogLevel::kWarning));
}

TEST_F(JobEventsTest, AJobThatIsGivenUpAtTheStartIsAFailure) {
  const auto request = ResolveRequest(Request(20'000));
  const std::string digest = RequestDigest(*request);
  ASSERT_TRUE(
      database_->jobs()
          .Put({.digest = digest, .request = request->SerializeAsString(), .start_count = 10})
          .ok());
  MakeQueue(kSucceed);
  EXPECT_EQ(queue_->Get(digest)->state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(Lines(), ElementsAre(StartsWith("job_failed job=jobs/" + digest + " reason=")));
}

}  // namespace
}  // namespace carillon
