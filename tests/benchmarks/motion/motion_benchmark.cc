// SPDX-License-Identifier: Apache-2.0
//
// Lets bodies fall in an engine at 2400 Hz, finds their contacts from the poses of frames alone,
// and prints how these compare with the engine's: a line for each scene and frame rate.
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/motion/find_contacts.h"
#include "tests/benchmarks/stopwatch.h"
#include "tests/client_sdk/motion/fall_truth.h"

namespace carillon::motion {
namespace {

#ifdef CARILLON_MUJOCO
/// MuJoCo leaves the poses from before its step. Gives those after it, as the other engines do.
falls::Simulation FallInMujocoWithPosesAfter(const falls::FallScene& scene, double step_s) {
  const falls::Simulation simulation = falls::FallInMujoco(scene, step_s).value();
  const auto next = std::make_shared<v1::ContactStep>(simulation());
  return [simulation, next] {
    v1::ContactStep step = std::exchange(*next, simulation());
    *step.mutable_poses() = next->poses();
    return step;
  };
}
#endif

Engine EngineOf(const std::string& name) {
  if (name == "ode") return falls::FallInOde;
#ifdef CARILLON_MUJOCO
  if (name == "mujoco") return FallInMujocoWithPosesAfter;
#endif
  return falls::FallInBullet;
}

void PrintRow(const std::string& name, const falls::FallScene& scene, const Engine& engine,
              int frames_per_second) {
  const double step_s = name == "crowd" ? 1.0 / 240 : 1.0 / 2400;
  const Fall fall =
      Drop(scene, engine, static_cast<int>(std::lround(1 / step_s)) / frames_per_second, step_s);
  const Stopwatch watch;
  const auto found = FindContacts(fall.motion);
  const double cpu_s = watch.CpuSeconds(), wall_s = watch.Seconds();
  std::printf("%s\t%d\t", name.c_str(), frames_per_second);
  if (!found.ok()) {
    std::printf("%s\n", std::string(found.status().message()).c_str());
    return;
  }
  const Likeness is = Compare(fall, *found);
  std::printf(
      "%d/%d (%.1f %%)\t%d (%.1f %%)\t%.2f, %.2f\t%.1f %%, %.1f %%\t%.1f\t%.3f %%\t%.0f %%\t",
      is.found_count, is.true_count, 100 * is.found_share, is.false_count, 100 * is.false_share,
      1e3 * is.median_dt_s, 1e3 * is.dt90_s, 100 * is.median_size_error,
      100 * is.median_vector_error, 1e3 * is.median_point_m, 100 * found->confidence.unexplained,
      100 * found->confidence.ambiguity);
  std::printf("%.2f, %.2f\n", cpu_s, wall_s);
  std::fflush(stdout);
}

/// Prints the means over ten piles of blocks: one pile falls in one way only. Of a pile that is
/// refused nothing is found.
void PrintPiles(const Engine& engine, int frames_per_second) {
  constexpr int kPiles = 10;
  Likeness mean;
  for (int i = 0; i < kPiles; ++i) {
    const Fall fall = Drop(BlocksScene(i), engine, 2400 / frames_per_second);
    const auto found = FindContacts(fall.motion);
    if (!found.ok()) continue;
    const Likeness is = Compare(fall, *found);
    mean.found_share += is.found_share / kPiles;
    mean.false_share += is.false_share / kPiles;
  }
  std::printf("ten piles\t%d\t%.1f %%\t%.1f %%\n", frames_per_second, 100 * mean.found_share,
              100 * mean.false_share);
  std::fflush(stdout);
}

/// Fifty boxes that fall from different heights, for 20 s.
falls::FallScene CrowdScene() {
  falls::FallScene scene = CornerScene();
  const falls::Body box = scene.bodies[1];
  scene.bodies.resize(1);
  for (int i = 0; i < 50; ++i) {
    falls::Body& one = scene.bodies.emplace_back(box);
    one.name += std::to_string(i);
    one.position_m = {0.11 * (i % 5), 0.11 * (i / 5 % 5), 0.2 + 0.15 * i};
  }
  scene.seconds = 20;
  return scene;
}

int Main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  const Engine engine = EngineOf(words.empty() ? "bullet" : words[0]);
  const std::vector<std::pair<std::string, falls::FallScene>> scenes = {{"air", AirScene()},
                                                                        {"bounce", BounceScene()},
                                                                        {"corner", CornerScene()},
                                                                        {"blocks", BlocksScene()}};
  for (const auto& [name, scene] : scenes) {
    for (const int rate : {24, 30, 60, 120, 240}) {
      if (words.size() > 2 && words[2] != std::to_string(rate)) continue;
      if (words.size() < 2 || words[1] == name) PrintRow(name, scene, engine, rate);
    }
  }
  for (const int rate : {60, 120, 240}) {
    if (words.size() > 2 && words[2] != std::to_string(rate)) continue;
    if (words.size() > 1 && words[1] == "piles") PrintPiles(engine, rate);
  }
  if (words.size() > 1 && words[1] == "crowd") PrintRow("crowd", CrowdScene(), engine, 60);
  return 0;
}

}  // namespace
}  // namespace carillon::motion

int main(int argc, char** argv) { return carillon::motion::Main(argc, argv); }
