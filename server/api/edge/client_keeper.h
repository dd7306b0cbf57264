// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <utility>

#include "server/api/edge/idle_calls.h"
#include "server/api/edge/scene_owners.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// Ends scenes whose lease is over, and idle calls.
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
  };

  /// The parts of `kept` must outlive the keeper.
  explicit ClientKeeper(Kept kept) : kept_(std::move(kept)) {}

  /// Must be called several times a second.
  void Look() const;

 private:
  const Kept kept_;
};

}  // namespace carillon
