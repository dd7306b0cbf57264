// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/fair_turns.h"

#include <utility>

namespace carillon {

void FairTurns::Run(const std::string& client, std::function<void()> task) {
  const MutexLock lock(&mutex_);
  Client& entry = clients_[client];
  entry.tasks.push_back(std::move(task));
  GiveTurns(client, entry);
  AskForThreads();
}

void FairTurns::GiveTurns(const std::string& name, Client& client) {
  while (client.turn_count < static_cast<int>(client.tasks.size()) &&
         client.turn_count + client.running_count < most_of_client_) {
    ++client.turn_count;
    turns_.push_back(name);
  }
}

void FairTurns::AskForThreads() {
  while (asked_count_ < static_cast<int>(turns_.size()) &&
         asked_count_ + running_count_ < most_running_) {
    ++asked_count_;
    pool_.Run([this] { RunNext(); });
  }
}

void FairTurns::RunNext() {
  std::string name;
  std::function<void()> task;
  {
    const MutexLock lock(&mutex_);
    name = std::move(turns_.front());
    turns_.pop_front();
    Client& client = clients_[name];
    --client.turn_count;
    ++client.running_count;
    task = std::move(client.tasks.front());
    client.tasks.pop_front();
    --asked_count_;
    ++running_count_;
  }
  task();
  task = nullptr;
  const MutexLock lock(&mutex_);
  --running_count_;
  const auto client = clients_.find(name);
  --client->second.running_count;
  GiveTurns(name, client->second);
  if (client->second.turn_count + client->second.running_count == 0) clients_.erase(client);
  AskForThreads();
}

}  // namespace carillon
