// SPDX-License-Identifier: Apache-2.0
//
// How users test their own code without a daemon: they mock the calls that it makes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "carillon/client.h"

namespace carillon::client {
namespace {

using testing::_;
using testing::ElementsAre;
using testing::Property;
using testing::Return;

/// A user's code: drops a ball and sends the impulse of each bounce, half as strong as the last.
absl::Status PlayBounces(const Client& daemon, const std::string& scene, uint32_t ball) {
  v1::ContactStreamStart start;
  start.set_scene(scene);
  auto contacts = daemon.StreamContacts(start);
  if (!contacts.ok()) return contacts.status();
  for (double impulse = 0.4; impulse > 0.1; impulse /= 2) {
    v1::ContactStep step;
    v1::Contact& impact = *step.add_contacts();
    impact.set_kind(v1::CONTACT_KIND_IMPACT);
    impact.set_object(ball);
    impact.mutable_impulse_newton_seconds()->set_z(impulse);
    if (absl::Status sent = (*contacts)->Send(std::move(step)); !sent.ok()) return sent;
  }
  return (*contacts)->Finish().status();
}

class MockClient : public Client {
 public:
  MOCK_METHOD(absl::StatusOr<std::unique_ptr<ContactStream>>, StreamContacts,
              (const v1::ContactStreamStart&), (const, override));
};

class MockContactStream : public ContactStream {
 public:
  MOCK_METHOD(absl::Status, Send, (v1::ContactStep), (override));
  MOCK_METHOD(v1::StreamContactsResponse, Report, (), (const, override));
  MOCK_METHOD(absl::StatusOr<v1::StreamContactsResponse>, Finish, (), (override));
};

TEST(UsersCode, CanBeTestedWithAMockOfTheClient) {
  auto stream = std::make_unique<MockContactStream>();
  std::vector<double> impulses;
  EXPECT_CALL(*stream, Send).Times(2).WillRepeatedly([&](const v1::ContactStep& step) {
    impulses.push_back(step.contacts(0).impulse_newton_seconds().z());
    return absl::OkStatus();
  });
  EXPECT_CALL(*stream, Finish).WillOnce(Return(v1::StreamContactsResponse()));
  MockClient daemon;
  EXPECT_CALL(daemon, StreamContacts(Property(&v1::ContactStreamStart::scene, "scenes/1")))
      .WillOnce([&](const auto&) { return std::move(stream); });
  EXPECT_EQ(PlayBounces(daemon, "scenes/1", 7), absl::OkStatus());
  EXPECT_THAT(impulses, ElementsAre(0.4, 0.2));
}

TEST(UsersCode, CanBeTestedWithARefusalOfTheDaemon) {
  MockClient daemon;
  EXPECT_CALL(daemon, StreamContacts(_))
      .WillOnce(Return(absl::NotFoundError("SCENE_NOT_FOUND: there is no scene 'scenes/1'")));
  const absl::Status status = PlayBounces(daemon, "scenes/1", 7);
  EXPECT_EQ(ToErrorInfo(status).reason(), "SCENE_NOT_FOUND");
  EXPECT_EQ(ToErrorInfo(status).message(), "there is no scene 'scenes/1'");
}

TEST(UsersCode, IsToldWhichCallItsMockLacks) {
  const MockClient daemon;
  const absl::Status status = daemon.DeleteScene("scenes/1");
  EXPECT_EQ(status.code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("Client::DeleteScene"));
}

/// Two pages of models, and two of jobs.
class PagedClient : public Client {
 public:
  absl::StatusOr<v1::ListModalModelsResponse> ListModalModelsPage(
      const v1::ListModalModelsRequest& request) const override {
    v1::ListModalModelsResponse page;
    page.add_modal_models()->set_name(request.tag() + request.page_token());
    if (request.page_token().empty()) page.set_next_page_token("2");
    return page;
  }
  absl::StatusOr<v1::ListJobsResponse> ListJobsPage(
      const v1::ListJobsRequest& request) const override {
    if (!request.page_token().empty()) return absl::UnavailableError("SERVER_UNAVAILABLE: gone");
    v1::ListJobsResponse page;
    page.set_next_page_token("2");
    return page;
  }
};

TEST(ListModalModels, JoinsAllPagesThatMatchTheFilter) {
  v1::ListModalModelsRequest filter;
  filter.set_tag("bell");
  filter.set_page_token("a page that is not the first");
  const auto models = PagedClient().ListModalModels(filter);
  ASSERT_EQ(models.status(), absl::OkStatus());
  EXPECT_THAT(*models, ElementsAre(Property(&v1::ModalModelSummary::name, "bell"),
                                   Property(&v1::ModalModelSummary::name, "bell2")));
}

TEST(ListJobs, ReturnsTheErrorOfALaterPage) {
  EXPECT_EQ(PagedClient().ListJobs().status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace carillon::client
