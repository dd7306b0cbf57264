// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "client_sdk/interchange/npy_array.h"
#include "client_sdk/interchange/zip_archive.h"
#include "client_sdk/motion/files/motion_scene.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::motion {
namespace {

absl::Status Malformed(const std::string& path, absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MOTION_MALFORMED",
                 absl::StrCat(path, ": ", what));
}

/// Returns a refusal that names the first gap between the times, if there is one.
absl::Status CheckGaps(const std::string& path, const std::vector<double>& times) {
  std::vector<double> spacings_s;
  for (size_t k = 1; k < times.size(); ++k) spacings_s.push_back(times[k] - times[k - 1]);
  const auto middle = spacings_s.begin() + static_cast<std::ptrdiff_t>(spacings_s.size() / 2);
  std::ranges::nth_element(spacings_s, middle);
  const double usual_s = *middle;
  for (size_t k = 1; k < times.size() && usual_s > 0; ++k) {
    if (times[k] - times[k - 1] < 1.5 * usual_s) continue;
    return Malformed(
        path, absl::StrCat("frames are missing between ", times[k - 1], " s and ", times[k],
                           " s, where the others are ", usual_s, " s apart: give each of them"));
  }
  return absl::OkStatus();
}

/// Sets the times of the frames, which must be equally far apart.
absl::Status SetTimes(const std::string& path, const std::vector<double>& times, Motion& motion) {
  if (times.size() < 2) return Malformed(path, "poses of one time alone are no motion");
  RETURN_IF_ERROR(CheckGaps(path, times));
  motion.first_time_s = times.front();
  motion.frame_s = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
  for (size_t k = 0; k < times.size(); ++k) {
    const double expected = motion.first_time_s + static_cast<double>(k) * motion.frame_s;
    if (motion.frame_s > 0 && std::abs(times[k] - expected) < 0.01 * motion.frame_s) continue;
    return Malformed(path, absl::StrCat("frame ", k, " is at ", times[k], " s instead of ",
                                        expected, " s: frames must be equally far apart in time"));
  }
  return absl::OkStatus();
}

BodyPose PoseOf(const double* x, const double* q) {
  return {{x[0], x[1], x[2]}, Turn(q[0], q[1], q[2], q[3])};
}

constexpr std::array<const char*, 9> kColumns = {"t",  "body", "x",  "y", "z",
                                                 "qw", "qx",   "qy", "qz"};

/// Reads a text of poses, whose line of names says in which order its columns are.
class PoseTextReader {
 public:
  explicit PoseTextReader(const std::string& path) : path_(path) {
    std::iota(place_.begin(), place_.end(), size_t{0});
  }

  absl::Status Read(std::string line) {
    if (++line_number_ == 1 && absl::StartsWith(line, "\xEF\xBB\xBF")) line.erase(0, 3);
    std::vector<std::string> cells = absl::StrSplit(
        line, line.find(',') == std::string::npos ? absl::ByAnyChar(";\t") : absl::ByAnyChar(","));
    for (std::string& cell : cells) absl::StripAsciiWhitespace(&cell);
    if (cells.size() == 1 && cells[0].empty()) return absl::OkStatus();
    double t = 0;
    const bool named =
        std::exchange(first_, false) &&
        std::ranges::none_of(cells, [&](const auto& c) { return absl::SimpleAtod(c, &t); });
    return named ? ReadNames(cells) : ReadPose(cells);
  }

  absl::StatusOr<MotionScene> Take() {
    for (size_t body = 0; body < times_.size(); ++body) {
      RETURN_IF_ERROR(CheckComplete(scene_.motion.bodies[body].name, times_[body]));
    }
    std::vector<double> times;
    for (const auto& [t, row] : first_rows_) times.push_back(t);
    RETURN_IF_ERROR(SetTimes(path_, times, scene_.motion));
    return std::move(scene_);
  }

 private:
  /// The line and the body of a pose.
  struct Row {
    size_t line = 0;
    std::string body;
  };

  /// Returns a refusal that names the first time at which a body has no pose, if there is one.
  absl::Status CheckComplete(const std::string& name, const std::vector<double>& times) const {
    size_t k = 0;
    for (const auto& [t, row] : first_rows_) {
      if (k < times.size() && times[k] == t) {
        ++k;
        continue;
      }
      return Malformed(
          path_, absl::StrCat(name, " has no pose at ", t, " s, when line ", row.line,
                              " has one of ", row.body, ": each body needs one pose at each time"));
    }
    return absl::OkStatus();
  }

  absl::Status ReadNames(const std::vector<std::string>& cells) {
    for (size_t i = 0; i < kColumns.size(); ++i) {
      const auto same = [&](const std::string& cell) {
        return absl::EqualsIgnoreCase(cell, kColumns[i]);
      };
      const auto at = std::ranges::find_if(cells, same);
      if (at == cells.end()) {
        return Malformed(path_,
                         absl::StrCat("the column ", kColumns[i], " is missing: name the columns ",
                                      absl::StrJoin(kColumns, ","), ", in any order"));
      }
      place_[i] = static_cast<size_t>(at - cells.begin());
    }
    column_count_ = cells.size();
    return absl::OkStatus();
  }

  absl::Status ReadPose(const std::vector<std::string>& cells) {
    double t = 0;
    std::array<double, 7> x{};
    bool good =
        cells.size() == column_count_ && absl::SimpleAtod(cells[place_[0]], &t) && std::isfinite(t);
    for (size_t i = 0; i < x.size() && good; ++i) {
      good = absl::SimpleAtod(cells[place_[i + 2]], &x[i]) && std::isfinite(x[i]);
    }
    if (!good) {
      return Malformed(path_,
                       absl::StrCat("line ", line_number_, " has no number for each of ",
                                    absl::StrJoin(kColumns, ","),
                                    ": fill gaps, or cut the time in which a body is not seen"));
    }
    const auto [at, is_new] = bodies_.try_emplace(cells[place_[1]], times_.size());
    if (is_new) {
      scene_.motion.bodies.emplace_back().name = at->first;
      times_.emplace_back();
    }
    std::vector<double>& times = times_[at->second];
    if (!times.empty() && t <= times.back()) {
      return Malformed(
          path_, absl::StrCat("line ", line_number_, " has ", at->first, " at ", t,
                              " s: each body needs one pose at each time, in the order of times"));
    }
    times.push_back(t);
    first_rows_.try_emplace(t, Row{line_number_, at->first});
    scene_.motion.bodies[at->second].poses.push_back(PoseOf(x.data(), x.data() + 3));
    return absl::OkStatus();
  }

  std::string path_;
  size_t line_number_ = 0, column_count_ = kColumns.size();
  bool first_ = true;  ///< no line with text was read
  std::array<size_t, kColumns.size()> place_;
  std::map<std::string, size_t> bodies_;
  std::vector<std::vector<double>> times_;  ///< of each body
  std::map<double, Row> first_rows_;        ///< the first of each time
  MotionScene scene_;
};

/// True of a file of another program, such as .blend and .fbx, which has zeros near its beginning.
bool IsBinary(std::ifstream& file) {
  std::string head(1024, ' ');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  file.clear();
  file.seekg(0);
  return head.find('\0') != std::string::npos;
}

absl::StatusOr<MotionScene> ReadCsv(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(path, " cannot be opened"));
  }
  if (IsBinary(file)) {
    return Malformed(path,
                     "the file is neither a glTF (.glb, .gltf) nor a table of poses (.csv, .npz): "
                     "export the animation as a glTF");
  }
  PoseTextReader reader(path);
  for (std::string line; std::getline(file, line);) RETURN_IF_ERROR(reader.Read(line));
  return reader.Take();
}

absl::StatusOr<interchange::NpyArray> ArrayOf(const interchange::ZipReader& zip,
                                              const std::string& path, const std::string& name) {
  ASSIGN_OR_RETURN(const auto file, zip.Read(absl::StrCat(name, ".npy")));
  if (!file) return Malformed(path, absl::StrCat("the array ", name, " is missing"));
  return interchange::ParseNpy(name, *file);
}

absl::StatusOr<std::vector<std::string>> NamesOf(const interchange::NpyArray& array) {
  std::vector<std::string> names;
  const size_t count = array.shape.empty() ? 1 : array.shape[0];
  const size_t size = count > 0 ? array.bytes.size() / count : 0;
  for (size_t i = 0; i < count; ++i) {
    ASSIGN_OR_RETURN(std::string name,
                     interchange::ToText("bodies", {.type = array.type,
                                                    .shape = {},
                                                    .bytes = array.bytes.substr(i * size, size)}));
    names.push_back(std::move(name));
  }
  return names;
}

absl::StatusOr<MotionScene> ReadNpz(const std::string& path) {
  ASSIGN_OR_RETURN(const interchange::ZipReader zip, interchange::ZipReader::Open(path));
  std::vector<double> times, x, q;
  ASSIGN_OR_RETURN(const interchange::NpyArray time_array, ArrayOf(zip, path, "times"));
  RETURN_IF_ERROR(interchange::ToNumbers("times", time_array, times));
  ASSIGN_OR_RETURN(const interchange::NpyArray places, ArrayOf(zip, path, "positions"));
  RETURN_IF_ERROR(interchange::ToNumbers("positions", places, x));
  ASSIGN_OR_RETURN(const interchange::NpyArray turns, ArrayOf(zip, path, "orientations"));
  RETURN_IF_ERROR(interchange::ToNumbers("orientations", turns, q));
  ASSIGN_OR_RETURN(const interchange::NpyArray name_array, ArrayOf(zip, path, "bodies"));
  ASSIGN_OR_RETURN(const std::vector<std::string> names, NamesOf(name_array));
  const size_t count = names.size();
  const auto has_shape = [&](const interchange::NpyArray& array, size_t width) {
    return std::ranges::equal(array.shape, std::array{times.size(), count, width}) ||
           (count == 1 && std::ranges::equal(array.shape, std::array{times.size(), width}));
  };
  if (!has_shape(places, 3) || !has_shape(turns, 4)) {
    return Malformed(path, absl::StrCat("positions must be (", times.size(), ", ", count,
                                        ", 3) and orientations (", times.size(), ", ", count,
                                        ", 4), as times and bodies are"));
  }
  MotionScene scene;
  for (size_t body = 0; body < count; ++body) {
    MovingBody& moving = scene.motion.bodies.emplace_back();
    moving.name = names[body];
    for (size_t k = 0; k < times.size(); ++k) {
      moving.poses.push_back(PoseOf(&x[3 * (k * count + body)], &q[4 * (k * count + body)]));
    }
  }
  RETURN_IF_ERROR(SetTimes(path, times, scene.motion));
  return scene;
}

/// A body that never moves has one pose.
void FixStill(MovingBody& body) {
  const auto same = [&](const BodyPose& pose) {
    return pose.position_m == body.poses[0].position_m &&
           pose.orientation.coeffs() == body.poses[0].orientation.coeffs();
  };
  if (!body.poses.empty() && std::ranges::all_of(body.poses, same)) body.poses.resize(1);
}

}  // namespace

absl::StatusOr<MotionScene> ReadPoseTable(const std::string& path) {
  absl::StatusOr<MotionScene> scene =
      absl::EndsWithIgnoreCase(path, ".npz") ? ReadNpz(path) : ReadCsv(path);
  if (!scene.ok()) {
    const v1::ErrorInfo info = ToErrorInfo(scene.status());
    if (info.reason() != "MODEL_FILE_MALFORMED") return scene;
    return Malformed(path, absl::StripPrefix(info.message(), absl::StrCat(path, " ")));
  }
  scene->bodies.resize(scene->motion.bodies.size());
  for (MovingBody& body : scene->motion.bodies) FixStill(body);
  return scene;
}

}  // namespace carillon::motion
