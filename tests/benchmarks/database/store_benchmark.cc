// SPDX-License-Identifier: Apache-2.0
//
// One step of the database benchmark a run, so that nothing stays in memory from one to the next:
//
//   store_benchmark FOLDER STEP NUMBER     prints seconds
//
//   make MB    a model of so many megabytes as a file; no time is printed
//   write MB   stores it              flat_write MB   writes its arrays to a flat file, and syncs
//   load MB    finds it, all checked  flat_load MB    maps that file and copies the arrays out of
//   it fill N     stores N small models; no time is printed open N     finds each of them list N
//   lists them, a thousand a page

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/mode_database/codec/model_codec.h"
#include "server/mode_database/mode_database.h"

namespace carillon {
namespace {

constexpr size_t kModeCount = 200;

template <typename T>
T OrDie(absl::StatusOr<T> value) {
  if (value.ok()) return *std::move(value);
  std::cerr << value.status() << "\n";
  std::exit(1);
}

void OrDie(const absl::Status& status) {
  if (status.ok()) return;
  std::cerr << status << "\n";
  std::exit(1);
}

/// A sphere of `ring_count` rings of twice as many vertices; its shapes mean nothing.
ModalModel Sphere(size_t ring_count, size_t mode_count) {
  ModalModel model;
  model.poisson_ratio = 0.33;
  model.complete_to_eigenvalue = 600;
  const size_t around = 2 * ring_count;
  for (size_t ring = 0; ring < ring_count; ++ring) {
    const double polar =
        std::numbers::pi * (static_cast<double>(ring) + 0.5) / static_cast<double>(ring_count);
    for (size_t i = 0; i < around; ++i) {
      const double angle =
          2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(around);
      model.vertices.push_back({static_cast<float>(0.1 * std::sin(polar) * std::cos(angle)),
                                static_cast<float>(0.1 * std::sin(polar) * std::sin(angle)),
                                static_cast<float>(0.1 * std::cos(polar))});
    }
  }
  for (uint32_t ring = 0; ring + 1 < ring_count; ++ring) {
    for (uint32_t i = 0; i < around; ++i) {
      const auto n = static_cast<uint32_t>(around);
      const uint32_t a = ring * n + i;
      const uint32_t b = ring * n + (i + 1) % n;
      model.triangles.push_back({a, a + n, b});
      model.triangles.push_back({b, a + n, b + n});
    }
  }
  for (uint32_t t = 0; t < model.triangles.size(); ++t) model.given_triangle.push_back(t);
  model.given_vertices = model.vertices;
  model.given_triangles = model.triangles;
  for (size_t i = 0; i < mode_count; ++i) {
    model.eigenvalues.push_back(1 +
                                599.0 * static_cast<double>(i) / static_cast<double>(mode_count));
    model.couplings.push_back(1e-3);
  }
  model.shapes.resize(model.vertices.size() * 3 * mode_count);
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    model.shapes[i] = static_cast<float>(i % 1013) * 0.001F;
  }
  return model;
}

ModalModel ModelOf(double megabytes) {
  const double vertex_count = megabytes * 1e6 / (3 * 4 * kModeCount);
  return Sphere(static_cast<size_t>(std::sqrt(vertex_count / 2)), kModeCount);
}

void WriteModel(const std::filesystem::path& file, const ModalModel& model) {
  v1::ModalModelHeader header;
  header.set_format_version(1);
  header.set_solver("benchmark");
  header.mutable_settings()->set_poisson_ratio(model.poisson_ratio);
  header.set_complete_to_eigenvalue(model.complete_to_eigenvalue);
  std::ofstream out(file, std::ios::binary);
  OrDie(EncodeModel(model, header, std::vector<double>(model.mode_count(), 1e-9),
                    [&](const v1::ModalModelRecord& record) {
                      out << Delimited(record);
                      return absl::OkStatus();
                    }));
}

/// The largest array alone: all others together are a hundredth of it.
void WriteFlat(const std::filesystem::path& file, const ModalModel& model) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const char* bytes = reinterpret_cast<const char*>(model.shapes.data());
  for (size_t left = model.shapes.size() * sizeof(float); left > 0;) {
    const ssize_t written = write(descriptor, bytes, left);
    if (written <= 0) std::exit(1);
    bytes += written;
    left -= static_cast<size_t>(written);
  }
  fsync(descriptor);
  close(descriptor);
}

size_t LoadFlat(const std::filesystem::path& file) {
  const size_t size = std::filesystem::file_size(file);
  const int descriptor = open(file.c_str(), O_RDONLY);
  void* const mapped = mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, descriptor, 0);
  std::vector<float> shapes(size / sizeof(float));
  std::memcpy(shapes.data(), mapped, size);
  munmap(mapped, size);
  close(descriptor);
  return shapes.size();
}

class Benchmark {
 public:
  Benchmark(std::filesystem::path folder, int64_t number)
      : folder_(std::move(folder)), number_(number) {}

  void Make() { WriteModel(File(".model"), ModelOf(static_cast<double>(number_))); }

  void Write() {
    Open();
    Time([&] { OrDie(database_->models().PutFile(Name(number_), "", File(".model")).status()); });
  }

  void Load() {
    Open();
    Time([&] { OrDie(database_->models().Find(Name(number_)).status()); });
  }

  void FlatWrite() {
    const ModalModel model = ModelOf(static_cast<double>(number_));
    Time([&] { WriteFlat(File(".flat"), model); });
  }

  void FlatLoad() {
    Time([&] { std::cerr << LoadFlat(File(".flat")) << " numbers\n"; });
  }

  void Fill() {
    Open();
    WriteModel(File(".small"), Sphere(8, 10));
    for (int64_t i = 0; i < number_; ++i) {
      OrDie(database_->models()
                .PutFile(Name(1000 + i), absl::StrCat("model ", i), File(".small"))
                .status());
    }
  }

  void OpenAll() {
    Open();
    Time([&] {
      for (int64_t i = 0; i < number_; ++i) {
        OrDie(database_->models().Find(Name(1000 + i)).status());
      }
    });
  }

  void List() {
    Open();
    Time([&] {
      std::string token;
      do {
        token = OrDie(database_->models().List({}, 1000, token)).next_page_token;
      } while (!token.empty());
    });
  }

 private:
  static std::string Name(int64_t number) { return Sha256Hex(absl::StrCat("model ", number)); }

  std::filesystem::path File(const char* suffix) const {
    return folder_ / absl::StrCat(number_, suffix);
  }

  void Open() { database_ = OrDie(ModeDatabase::Open(folder_ / "carillon.db", clock_)); }

  static void Time(const std::function<void()>& work) {
    const auto begun = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begun;
    std::printf("%.6f\n", taken.count());
  }

  const std::filesystem::path folder_;
  const int64_t number_;
  SystemClock clock_;
  std::unique_ptr<ModeDatabase> database_;
};

int Main(int argc, char** argv) {
  const std::map<std::string, void (Benchmark::*)()> steps = {
      {"make", &Benchmark::Make},          {"write", &Benchmark::Write},
      {"load", &Benchmark::Load},          {"flat_write", &Benchmark::FlatWrite},
      {"flat_load", &Benchmark::FlatLoad}, {"fill", &Benchmark::Fill},
      {"open", &Benchmark::OpenAll},       {"list", &Benchmark::List}};
  if (argc != 4 || !steps.contains(argv[2])) {
    std::cerr << "usage: store_benchmark FOLDER STEP NUMBER\n";
    return 2;
  }
  Benchmark benchmark(argv[1], std::atoll(argv[3]));
  (benchmark.*steps.at(argv[2]))();
  return 0;
}

}  // namespace
}  // namespace carillon

int main(int argc, char** argv) { return carillon::Main(argc, argv); }
