// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <semaphore>
#include <string>
#include <thread>

#include "server/api/idle_calls.h"
#include "server/api/scene_owners.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// A thread that ends scenes whose lease is over, and idle calls.
class ClientKeeper {
 public:
  /// Takes a line for people to read.
  using Log = std::function<void(const std::string&)>;

  struct Kept {
    SceneRegistry& scenes;
    SceneOwners& owners;
    IdleCalls& idle_calls;
    std::chrono::nanoseconds idle_limit;
    Log log;
    std::function<void()> tick;  ///< called several times a second
  };

  /// The parts of `kept` must outlive the keeper.
  explicit ClientKeeper(Kept kept);

  /// Joins the thread.
  ~ClientKeeper();
  ClientKeeper(const ClientKeeper&) = delete;
  ClientKeeper& operator=(const ClientKeeper&) = delete;

 private:
  void Run();

  const Kept kept_;
  std::binary_semaphore stop_{0};
  std::thread thread_;
};

}  // namespace carillon
