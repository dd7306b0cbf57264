// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <semaphore>
#include <thread>
#include <vector>

namespace carillon {

/// Short tasks that one thread runs again and again.
class Timetable {
 public:
  using Clock = std::chrono::steady_clock;
  /// Returns the time after which the task is due again.
  using Task = std::function<Clock::duration()>;

  Timetable() = default;
  ~Timetable() { Stop(); }
  Timetable(const Timetable&) = delete;
  Timetable& operator=(const Timetable&) = delete;

  /// Adds a task, which is due at once. Must be called before Start.
  void Add(Task task);

  /// Runs the tasks on a thread of the timetable. There must be a task.
  void Start();

  /// Joins the thread. No task runs from then on.
  void Stop();

  /// Runs the tasks that are due, which the thread does by itself. Returns the time until the next
  /// task is due, or nothing if there is no task.
  std::optional<Clock::duration> RunDue();

 private:
  struct Entry {
    Task task;
    Clock::time_point due;
  };

  std::vector<Entry> entries_;
  std::binary_semaphore stop_{0};
  std::thread thread_;
};

}  // namespace carillon
