// SPDX-License-Identifier: Apache-2.0
#include "server/api/fair_pool.h"

#include <algorithm>
#include <utility>

namespace carillon {

FairPool::FairPool(int thread_count) : most_running_(std::max(1, thread_count / 2)) {
  for (int i = 0; i < thread_count; ++i) threads_.emplace_back([this] { RunTasks(); });
}

FairPool::~FairPool() {
  ready_.release(static_cast<ptrdiff_t>(threads_.size()));
  for (std::thread& thread : threads_) thread.join();
}

void FairPool::Run(const std::string& client, std::function<void()> task) {
  const MutexLock lock(&mutex_);
  Client& entry = clients_[client];
  entry.tasks.push_back(std::move(task));
  GiveTurns(client, entry);
}

void FairPool::GiveTurns(const std::string& name, Client& client) {
  while (client.turn_count < static_cast<int>(client.tasks.size()) &&
         client.turn_count + client.running_count < most_running_) {
    ++client.turn_count;
    turns_.push_back(name);
    ready_.release();
  }
}

void FairPool::RunTasks() {
  while (RunNext()) {
  }
}

bool FairPool::RunNext() {
  ready_.acquire();
  std::string name;
  std::function<void()> task;
  {
    const MutexLock lock(&mutex_);
    if (turns_.empty()) return false;
    name = std::move(turns_.front());
    turns_.pop_front();
    Client& client = clients_[name];
    --client.turn_count;
    ++client.running_count;
    task = std::move(client.tasks.front());
    client.tasks.pop_front();
  }
  task();
  const MutexLock lock(&mutex_);
  const auto client = clients_.find(name);
  --client->second.running_count;
  GiveTurns(name, client->second);
  if (client->second.turn_count + client->second.running_count == 0) clients_.erase(client);
  return true;
}

}  // namespace carillon
