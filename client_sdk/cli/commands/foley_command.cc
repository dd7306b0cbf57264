// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/foley_command.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <system_error>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "client_sdk/cli/commands/awaited_jobs.h"
#include "client_sdk/cli/commands/foley_bodies.h"
#include "client_sdk/cli/output/output.h"
#include "client_sdk/motion/contact_steps.h"
#include "client_sdk/motion/find_contacts.h"
#include "client_sdk/motion/free_fall.h"
#include "client_sdk/motion/pose_noise.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

namespace fs = std::filesystem;
using motion::MovingBody;

/// Engines let bodies overlap by less than this part of the smaller one's radius.
constexpr double kDeep = 0.1;
/// While it falls freely, a body is outside of others but for a part of its thickness.
constexpr double kSunk = 0.1;
/// Bodies that strike each other are less than this part of the smaller one's radius apart.
constexpr double kApart = 0.5;
/// The longest side of a body that strikes something, in lengths of the way that the body takes.
constexpr double kMostOfTravel = 10;
/// Shares of unexplained momentum from which the masses or shapes are doubtful, and from which the
/// contacts are wrong (docs/motion.md).
constexpr double kDoubtful = 0.001, kWrong = 0.03;
/// From this share on solutions that differ in their impulses explain the motion alike.
constexpr double kAmbiguous = 0.2;

motion::Vector SidesOf(const MovingBody& body) {
  Eigen::AlignedBox3d box;
  for (const motion::Vector& vertex : body.surface.vertices_m) box.extend(vertex);
  return box.sizes();
}

void List(const FoleyScene& foley) {
  const motion::Motion& motion = foley.scene.motion;
  absl::PrintF("%d frames of %.6g s, from %.6g s on, where the sound begins\n",
               motion.frame_count(), motion.frame_s, motion.first_time_s);
  for (size_t i = 0; i < motion.bodies.size(); ++i) {
    const MovingBody& body = motion.bodies[i];
    const FoleyBody& sounds = foley.bodies[i];
    const char* moves = body.poses.size() == 1 ? "fixed" : body.mass_kg > 0 ? "free" : "driven";
    const motion::Vector sides_m = SidesOf(body);
    absl::PrintF("%-20s  %-6s  %-16s  %10.4g kg  %.3g x %.3g x %.3g m  %6d triangles, %s%s\n",
                 EscapedText(body.name), moves,
                 !sounds.material.empty() ? sounds.material
                 : sounds.scenery.empty() ? "silent"
                                          : absl::StrCat("silent (", sounds.scenery, ")"),
                 body.mass_kg, sides_m.x(), sides_m.y(), sides_m.z(), body.surface.triangles.size(),
                 sounds.closed ? "closed" : "open",
                 foley.scene.bodies[i].material.empty()
                     ? ""
                     : absl::StrCat(", of \"", EscapedText(foley.scene.bodies[i].material), "\""));
  }
  for (const motion::SceneListener& listener : foley.scene.listeners) {
    absl::PrintF("%-20s  camera\n", EscapedText(listener.name));
  }
}

/// Says which bodies are silent because they never move: their models would take the most time.
void TellScenery(const FoleyScene& foley) {
  std::vector<std::string> still;
  const FoleyBody* first = nullptr;
  for (size_t i = 0; i < foley.bodies.size(); ++i) {
    const FoleyBody& body = foley.bodies[i];
    if (body.scenery.empty() || body.endless) continue;
    if (first == nullptr) first = &body;
    still.push_back(foley.scene.motion.bodies[i].name);
  }
  if (still.empty()) return;
  absl::FPrintF(stderr,
                "warning: %s %s silent, though of a material: to hear one, name it without a "
                "wildcard (--material '%s=%s'), which may take minutes\n",
                EscapedText(absl::StrJoin(still, ", ")),
                still.size() == 1 ? "never moves, and is" : "never move, and are",
                EscapedText(still.front()), first->scenery);
}

absl::Status CheckSounds(const FoleyScene& foley) {
  bool sounds = false;
  std::vector<std::string> open;
  for (size_t i = 0; i < foley.bodies.size(); ++i) {
    if (foley.bodies[i].material.empty()) continue;
    sounds = true;
    if (foley.bodies[i].closed || foley.bodies[i].repair) continue;
    open.push_back(foley.scene.motion.bodies[i].name);
  }
  if (!open.empty()) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "SURFACE_OPEN",
        absl::StrCat(absl::StrJoin(open, ", "), open.size() == 1 ? " is" : " are",
                     " not closed: close the surface, or repair it by --repair '", open.front(),
                     "', or keep it silent by --material '", open.front(), "=none'"));
  }
  if (sounds) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "BODY_UNKNOWN",
                 "no body that moves has a material: name one, such as --material '*=oak', or see "
                 "--list");
}

/// Leaves each n-th frame of noisy poses. A hat function of n frames takes the noise of a pose for
/// an n-th of the velocity, and then for no contact.
void TakeNoiseOut(motion::MotionScene& scene) {
  const motion::PoseNoise noise = motion::MeasureNoise(scene.motion);
  const size_t apart = noise.frames_apart;
  if (apart == 1 && noise.suffices) return;
  motion::TakeEach(apart, scene.motion);
  for (motion::SceneListener& listener : scene.listeners) {
    motion::TakeEach(apart, listener.poses);
  }
  absl::FPrintF(stderr,
                "warning: the poses have noise of %.2g mm: contacts are found at %.3g frames a "
                "second%s\n",
                1000 * noise.place_m, 1 / scene.motion.frame_s,
                noise.suffices ? "" : ", which still shows impacts that never were");
}

std::string UnitName(double metres) {
  if (metres == 1) return "metres";
  if (metres == 0.01) return "centimetres";
  return metres == 0.001 ? "millimetres" : absl::StrCat("units of ", metres, " m");
}

/// Refuses poses whose bodies fall as gravity would let them fall in another unit of length.
absl::Status CheckFall(const motion::Motion& motion, const FoleyOptions& options) {
  const motion::LengthMistake mistake = motion::FindLengthMistake(motion);
  if (mistake.factor == 1) return absl::OkStatus();
  const MovingBody& body = motion.bodies[mistake.body];
  const double gravity = motion.gravity_m_per_s2.norm();
  const std::string unit = UnitName(options.metres_per_unit / mistake.factor);
  absl::Status refusal = Refusal(
      absl::StatusCode::kInvalidArgument, "MOTION_UNIT_WRONG",
      absl::StrCat(body.name, " falls at ", mistake.factor * gravity, " m/s^2, and gravity is ",
                   gravity, ": the poses are in ", unit, ", and are read as ",
                   UnitName(options.metres_per_unit),
                   ". --unit has the unit of the poses and of the meshes; where "
                   "both differ, convert one (as it is read, ",
                   body.name, " is ", absl::SixDigits(SidesOf(body).maxCoeff()), " m long)"));
  if (!options.force) return refusal;
  absl::FPrintF(stderr, "warning: %s\n", EscapedText(ToErrorInfo(refusal).message()));
  return absl::OkStatus();
}

/// Returns how far a body gets from its first place, m.
double TravelOf(const MovingBody& body) {
  double travel_m = 0;
  for (const motion::BodyPose& pose : body.poses) {
    travel_m = std::max(travel_m, (pose.position_m - body.poses.front().position_m).norm());
  }
  return travel_m;
}

/// Returns by which factor all meshes would have to be larger for contacts to explain the motion
/// best, or 1 if none lets them explain it.
double FindMeshFactor(const FoleyScene& foley, const motion::FoundContacts& found) {
  // Bodies that are drawn too small never meet where they strike.
  const bool may_be_small = found.confidence.sunk_part <= kSunk &&
                            (found.blows.empty() || found.confidence.apart_part > kApart);
  const MovingBody& worst = foley.scene.motion.bodies[found.confidence.worst_body];
  double best = 1, least = kWrong;
  for (const double factor : {0.01, 0.001, 100.0, 1000.0}) {
    // A ball of 100 m reaches any floor.
    const bool is_huge = factor * SidesOf(worst).maxCoeff() > kMostOfTravel * TravelOf(worst);
    if (factor > 1 && (!may_be_small || is_huge)) continue;
    motion::Motion scaled = foley.scene.motion;
    for (size_t i = 0; i < scaled.bodies.size(); ++i) {
      if (!foley.bodies[i].endless) ScaleShape(factor, scaled.bodies[i]);
    }
    const absl::StatusOr<motion::FoundContacts> other = motion::FindContacts(scaled, true);
    if (!other.ok() || other->blows.empty()) continue;
    const motion::Confidence& is = other->confidence;
    const bool fits = is.deepest_part <= kDeep && is.sunk_part <= kSunk && is.apart_part <= kApart;
    if (!fits || is.unexplained >= least) continue;
    least = is.unexplained;
    best = factor;
  }
  return best;
}

/// Refuses contacts that do not explain the motion, and warns of doubtful ones.
absl::Status Judge(const FoleyScene& foley, const motion::FoundContacts& found, bool force) {
  const motion::Motion& motion = foley.scene.motion;
  const motion::Confidence& is = found.confidence;
  const std::string& worst = motion.bodies[is.worst_body].name;
  const double time_s = motion.first_time_s + static_cast<double>(is.worst_frame) * motion.frame_s;
  absl::FPrintF(stderr, "%d impacts, %d contact forces; unexplained %.3g %%, ambiguous %.2g %%\n",
                found.blows.size(), found.loads.size(), 100 * is.unexplained, 100 * is.ambiguity);
  const std::string where = absl::StrCat(worst, " near ", absl::SixDigits(time_s), " s");
  if (is.ambiguity > kAmbiguous) {
    absl::FPrintF(stderr,
                  "warning: other impulses explain the motion as well: %.0f %% of the impulse may "
                  "have acted at another corner or in the next frame%s\n",
                  100 * is.ambiguity, motion.frames_are_steps ? "" : "; more frames a second tell");
  }
  const auto warn_of_depth = [&](size_t a, size_t b, double depth_m, const char* when) {
    absl::FPrintF(stderr,
                  "warning: %s is up to %.3g m inside of %s %s: is the height of the floor "
                  "(--floor), the unit (--unit) or a mesh (--mesh) wrong?\n",
                  EscapedText(motion.bodies[a].name), depth_m, EscapedText(motion.bodies[b].name),
                  when);
  };
  if (is.deepest_part > kDeep) {
    warn_of_depth(is.deepest_a, is.deepest_b, is.deepest_m, "where they strike");
  }
  if (is.unexplained > kDoubtful && (force || is.unexplained <= kWrong)) {
    absl::FPrintF(stderr,
                  "warning: %.2g %% is unexplained, most of it of %s: the contacts there are less "
                  "sure\n",
                  100 * is.unexplained, EscapedText(where));
  }
  if (is.sunk_part > kSunk) {
    warn_of_depth(is.sunk_a, is.sunk_b, is.sunk_m, "while it falls freely");
  }
  if (force) return absl::OkStatus();
  const bool nothing = found.blows.empty() && found.loads.empty();
  const bool fits =
      is.unexplained <= kWrong && !nothing && is.sunk_part <= kSunk && is.apart_part <= kApart;
  if (const double factor = fits ? 1 : FindMeshFactor(foley, found); factor != 1) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MOTION_UNIT_WRONG",
                   absl::StrCat("contacts explain the motion if all meshes are ", factor,
                                " times as large, and not as they are (", worst, " is ",
                                absl::SixDigits(SidesOf(motion.bodies[is.worst_body]).maxCoeff()),
                                " m long): give poses and meshes in one unit, which --unit names"));
  }
  if (is.unexplained <= kWrong) {
    if (!nothing) return absl::OkStatus();
    return Refusal(absl::StatusCode::kInvalidArgument, "MOTION_WITHOUT_CONTACT",
                   "no body touches another, so there is nothing to hear: is a floor missing or "
                   "at the wrong height (--floor), or the unit (--unit) wrong?");
  }
  if (is.nearest_gap_m > 0.05 * is.worst_radius_m) {
    const std::string nearest =
        motion.bodies.size() == 1
            ? "no other body is there"
            : absl::StrCat("the nearest surface is ", absl::SixDigits(is.nearest_gap_m), " m away");
    return Refusal(
        absl::StatusCode::kInvalidArgument, "MOTION_WITHOUT_CONTACT",
        absl::StrCat(
            "the momentum of ", where, " changes, and ", nearest,
            ": is a floor missing (--floor), the unit (--unit) or --gravity wrong, a frame "
            "wrong or held, or the turn too fast for these frames, or is the body moved "
            "by hand (--driven)? --force renders all the same"));
  }
  return Refusal(
      absl::StatusCode::kInvalidArgument, "MOTION_UNEXPLAINED",
      absl::StrCat("contacts leave ", absl::SixDigits(100 * is.unexplained),
                   " % unexplained, and 3 % is the most; the worst is ", where,
                   ": check --gravity, --mass and --unit, export more frames a second, or name "
                   "bodies that are moved by hand (--driven); --force renders all the same"));
}

/// Scales impulses and forces of each pair by its reduced mass, from the masses of the simulation
/// to those of the materials: the speeds are seen, and the masses of a simulation often are not
/// meant.
void WeighByMaterial(const FoleyScene& foley, motion::FoundContacts& found) {
  const auto factor = [&](const motion::ContactPoint& contact) {
    double simulated = 0, meant = 0;  // sums of 1 / m
    for (const uint32_t body : {contact.a, contact.b}) {
      const double mass_kg = foley.scene.motion.bodies[body].mass_kg;
      if (mass_kg == 0) continue;
      const double by_material_kg = foley.bodies[body].material_mass_kg;
      simulated += 1 / mass_kg;
      meant += 1 / (by_material_kg > 0 ? by_material_kg : mass_kg);
    }
    return meant > 0 ? simulated / meant : 1;
  };
  for (motion::FoundBlow& blow : found.blows) blow.impulse_newton_seconds *= factor(blow);
  for (motion::FoundLoad& load : found.loads) load.force_newtons *= factor(load);
}

/// Makes the models of the bodies that sound; bodies of one surface and material share one.
class FoleyModels {
 public:
  explicit FoleyModels(AwaitedJobs& jobs) : awaited_(jobs), daemon_(jobs.daemon()) {}

  absl::Status Request(const MovingBody& body, const FoleyBody& sounds) {
    const std::string obj = motion::ObjText(body.surface);
    const std::string key = absl::StrCat(sounds.material, " ", sounds.wall_m, "\n", obj);
    const auto [at, is_new] = jobs_.try_emplace(key);
    keys_[&body] = key;
    if (!is_new) return absl::OkStatus();
    ASSIGN_OR_RETURN(std::string digest, daemon_.UploadMesh(obj));
    v1::CreateModalModelRequest request;
    request.set_mesh_digest(std::move(digest));
    request.set_mesh_format("obj");
    request.mutable_material()->set_preset(sounds.material);
    request.mutable_settings()->set_metres_per_unit(1);
    request.mutable_settings()->mutable_mesh()->set_wall_m(sounds.wall_m);
    request.mutable_settings()->mutable_mesh()->set_repair(sounds.repair);
    request.set_size(1);
    request.set_min_frequency_hz(20);
    request.set_label(body.name);
    ASSIGN_OR_RETURN(at->second, daemon_.CreateModalModel(request));
    if (at->second.state() != v1::JOB_STATE_SUCCEEDED) awaited_.Add(at->second.name());
    return absl::OkStatus();
  }

  absl::StatusOr<std::string> Await(const MovingBody& body) {
    v1::Job& job = jobs_[keys_[&body]];
    if (job.state() != v1::JOB_STATE_SUCCEEDED) {
      ASSIGN_OR_RETURN(job, awaited_.Await(job.name()));
    }
    return job.modal_model();
  }

 private:
  AwaitedJobs& awaited_;
  const client::Client& daemon_;
  std::map<const MovingBody*, std::string> keys_;
  std::map<std::string, v1::Job> jobs_;
};

/// The bodies that have no model, all of which are named at once.
class ModelFailures {
 public:
  void Add(const std::string& name, const absl::Status& status) {
    const bool mute = ToErrorInfo(status).reason() == "NO_MODE_IN_BAND";
    (mute ? mute_ : failed_).emplace_back(name, status);
  }

  /// Bodies without an audible mode stay silent if `others_sound`, with a warning.
  absl::Status Judge(bool others_sound) const {
    if (!failed_.empty()) return Together(failed_);
    if (!mute_.empty() && !others_sound) return Together(mute_);
    if (!mute_.empty()) {
      absl::FPrintF(stderr,
                    "warning: %s: too small or too stiff to be heard; silent, others strike it\n",
                    EscapedText(absl::StrJoin(mute_, ", ", kName)));
    }
    return absl::OkStatus();
  }

 private:
  using Failure = std::pair<std::string, absl::Status>;
  static constexpr auto kName = [](std::string* text, const Failure& failure) {
    absl::StrAppend(text, failure.first);
  };

  /// The first failure, with the names and the messages of all: bodies of one surface share a job,
  /// whose label is the name of one of them.
  static absl::Status Together(const std::vector<Failure>& failures) {
    const auto add = [](std::string* text, const Failure& failure) {
      absl::StrAppend(text, failure.first, ": ", ToErrorInfo(failure.second).message());
    };
    const absl::Status& first = failures.front().second;
    v1::ErrorInfo all = ToErrorInfo(first);
    all.set_message(absl::StrJoin(failures, "; ", add));
    return FromErrorInfo(first.code(), all);
  }

  std::vector<Failure> failed_, mute_;
};

void Set(v1::Pose& to, const motion::BodyPose& from) {
  to.mutable_position_m()->set_x(from.position_m.x());
  to.mutable_position_m()->set_y(from.position_m.y());
  to.mutable_position_m()->set_z(from.position_m.z());
  to.mutable_orientation()->set_w(from.orientation.w());
  to.mutable_orientation()->set_x(from.orientation.x());
  to.mutable_orientation()->set_y(from.orientation.y());
  to.mutable_orientation()->set_z(from.orientation.z());
}

/// Everything that is written into a trace.
struct FoleyTrace {
  v1::ContactTraceHeader header;
  std::vector<v1::ContactTraceObject> objects;
  std::vector<v1::ContactStep> steps;

  /// Writes the trace, with all times less by `earlier_s`; with `heard` above zero only that object
  /// is heard.
  absl::Status Write(const std::string& path, double earlier_s = 0, uint32_t heard = 0) const {
    ASSIGN_OR_RETURN(auto writer, client::ContactTraceWriter::Create(path, header));
    for (v1::ContactTraceObject object : objects) {
      if (heard > 0 && object.handle() != heard) object.set_gain(0);
      writer.Write(object);
    }
    for (v1::ContactStep step : steps) {
      step.set_time_s(step.time_s() - earlier_s);
      RETURN_IF_ERROR(writer.Write(step));
    }
    return writer.Close();
  }
};

absl::StatusOr<const motion::SceneListener*> FindListener(const FoleyOptions& options,
                                                          const FoleyScene& foley) {
  const auto& all = foley.scene.listeners;
  if (options.listener.empty()) {
    return options.sound.channel_count > 1 && !all.empty() ? &all.front() : nullptr;
  }
  const auto at = std::ranges::find(all, options.listener, &motion::SceneListener::name);
  if (at != all.end()) return &*at;
  return Refusal(absl::StatusCode::kInvalidArgument, "BODY_UNKNOWN",
                 absl::StrCat("no camera has the name ", options.listener, ": see --list"));
}

/// Lets the listener jump at the frames of these times, since the second of two poses at one time
/// takes effect at once.
void AddCuts(const std::vector<double>& cuts_s, double frame_s,
             std::vector<v1::ContactStep>& steps) {
  for (const double cut_s : cuts_s) {
    const auto at = std::ranges::find_if(
        steps, [&](const auto& step) { return step.time_s() > cut_s - 0.5 * frame_s; });
    if (at == steps.begin() || at == steps.end()) continue;
    v1::ContactStep before;
    before.set_time_s(at->time_s());
    *before.mutable_listener() = std::prev(at)->listener();
    steps.insert(at, std::move(before));
  }
}

absl::StatusOr<FoleyTrace> MakeTrace(AwaitedJobs& jobs, const FoleyOptions& options,
                                     const FoleyScene& foley, const motion::FoundContacts& found) {
  const motion::Motion& motion = foley.scene.motion;
  FoleyTrace trace;
  trace.header.set_simulator("carillon foley");
  trace.header.set_step_s(motion.frame_s);
  ASSIGN_OR_RETURN(const motion::SceneListener* listener, FindListener(options, foley));
  if (listener != nullptr) {
    trace.header.mutable_hearing()->set_distance_gain(true);
    trace.header.mutable_hearing()->set_panning(options.sound.channel_count > 1);
    Set(*trace.header.mutable_listener(), listener->poses.front());
  }
  FoleyModels models(jobs);
  motion::StepSettings settings{.handles = std::vector<uint32_t>(motion.bodies.size(), 0),
                                .strikers = {},
                                .roughness_depth = options.roughness_depth};
  settings.strikers.reserve(foley.bodies.size());
  for (const FoleyBody& body : foley.bodies) {
    settings.strikers.push_back(body.scenery.empty() ? options.silent_striker : body.scenery);
  }
  for (size_t i = 0; i < motion.bodies.size(); ++i) {
    if (foley.bodies[i].material.empty()) continue;
    RETURN_IF_ERROR(models.Request(motion.bodies[i], foley.bodies[i]));
  }
  ModelFailures failures;
  for (size_t i = 0; i < motion.bodies.size(); ++i) {
    if (foley.bodies[i].material.empty()) continue;
    absl::StatusOr<std::string> model = models.Await(motion.bodies[i]);
    if (!model.ok()) {
      failures.Add(motion.bodies[i].name, model.status());
      continue;
    }
    v1::ContactTraceObject& object = trace.objects.emplace_back();
    settings.handles[i] = static_cast<uint32_t>(trace.objects.size());
    object.set_handle(settings.handles[i]);
    object.set_label(motion.bodies[i].name);
    object.set_modal_model(*std::move(model));
    object.mutable_material()->set_preset(foley.bodies[i].material);
    Set(*object.mutable_pose(), motion.bodies[i].poses.front());
  }
  RETURN_IF_ERROR(failures.Judge(!trace.objects.empty()));
  trace.steps = motion::ToSteps(motion, found, settings);
  if (listener != nullptr && listener->poses.size() > 1) {
    for (size_t k = 0; k < trace.steps.size(); ++k) {
      Set(*trace.steps[k].mutable_listener(), listener->poses[k]);
    }
    AddCuts(options.cuts_s, motion.frame_s, trace.steps);
  }
  return trace;
}

/// Renders stems as `whole` was rendered, so that they add up to it.
absl::Status RenderStems(const client::Client& daemon, const FoleyOptions& options,
                         const RenderOptions& whole, const FoleyTrace& trace, double earlier_s) {
  std::error_code error;
  fs::create_directories(options.stems, error);
  if (error) {
    return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                   absl::StrCat(options.stems, ": ", error.message()));
  }
  for (const v1::ContactTraceObject& object : trace.objects) {
    RETURN_IF_ERROR(trace.Write(whole.trace, earlier_s, object.handle()));
    RenderOptions stem = whole;
    const std::string name = absl::StrReplaceAll(object.label(), {{"/", "_"}, {"\\", "_"}});
    stem.out =
        (fs::path(options.stems) / absl::StrCat(object.handle(), "-", name, ".wav")).string();
    RETURN_IF_ERROR(Render(daemon, stem, false).status());
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status MakeFoley(const Program& program, const FoleyOptions& options) {
  ASSIGN_OR_RETURN(FoleyScene foley, ReadFoleyScene(options));
  if (options.list) {
    List(foley);
    return absl::OkStatus();
  }
  TellScenery(foley);
  RETURN_IF_ERROR(CheckSounds(foley));
  const StopSignal stop;  // before the search for contacts starts threads
  const auto daemon = program.Daemon();
  AwaitedJobs jobs(*daemon, stop);
  TakeNoiseOut(foley.scene);
  RETURN_IF_ERROR(CheckFall(foley.scene.motion, options));
  ASSIGN_OR_RETURN(motion::FoundContacts found,
                   motion::FindContacts(foley.scene.motion, options.force));
  RETURN_IF_ERROR(Judge(foley, found, options.force));
  if (options.material_masses) WeighByMaterial(foley, found);
  ASSIGN_OR_RETURN(const FoleyTrace trace, MakeTrace(jobs, options, foley, found));
  const std::string temporary =
      (fs::temp_directory_path() / absl::StrCat("carillon-foley-", getpid(), ".contacts")).string();
  const absl::Cleanup remove = [&temporary] {
    std::error_code ignored;
    fs::remove(temporary, ignored);
  };
  if (!options.trace.empty()) RETURN_IF_ERROR(trace.Write(options.trace));
  if (options.sound.out.empty()) return absl::OkStatus();
  // A trace keeps the times of the file; a sound begins with the first pose.
  const double earlier_s = foley.scene.motion.first_time_s;
  RenderOptions sound = options.sound;
  sound.trace = temporary;
  RETURN_IF_ERROR(trace.Write(temporary, earlier_s));
  if (sound.wait) RETURN_IF_ERROR(AwaitTransfers(jobs, {temporary}));
  ASSIGN_OR_RETURN(const RenderOptions whole, Render(*daemon, sound, program.json));
  return options.stems.empty() ? absl::OkStatus()
                               : RenderStems(*daemon, options, whole, trace, earlier_s);
}

}  // namespace carillon::cli
