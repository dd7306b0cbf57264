// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/fit_commands.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client_sdk/cli/commands/find_model.h"
#include "client_sdk/cli/commands/measured_modes.h"
#include "client_sdk/cli/commands/mode_sound.h"
#include "client_sdk/cli/output/output.h"
#include "client_sdk/cli/output/wave_file.h"
#include "client_sdk/fit/residual.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

using Json = nlohmann::ordered_json;

/// A body, and its sound if it was given as recordings.
struct Source {
  fit::FittedBody body;
  Extracted extracted;
  std::vector<std::string> files;
  /// Why the radiation of the model is not known, with what repairs it; empty if it is known.
  std::string no_air;
};

absl::StatusOr<fit::ModelLines> LinesOf(const v1::ModalModelSummary& model) {
  const v1::ModalModelHeader& header = model.header();
  if (header.poisson_slopes_size() != model.eigenvalues_size()) {
    return Refusal(
        absl::StatusCode::kFailedPrecondition, "MODEL_LACKS_SLOPES",
        absl::StrCat(
            "the model \"", model.label(),
            "\" was made before models said how their frequencies change with Poisson's ratio, "
            "or elsewhere, or has several materials: delete it (carillon model delete), and create "
            "it again of its mesh"));
  }
  return fit::ModelLines{
      .poisson_ratio = header.settings().poisson_ratio(),
      .eigenvalues = {model.eigenvalues().begin(), model.eigenvalues().end()},
      .errors = {header.estimated_errors().begin(), header.estimated_errors().end()},
      .slopes = {header.poisson_slopes().begin(), header.poisson_slopes().end()},
      .complete_to_eigenvalue = header.complete_to_eigenvalue()};
}

/// The decay rate of each mode by radiation, for unit density and a speed sqrt(E/rho). Empty if no
/// transfer of the model is for about that speed.
std::vector<double> RadiationOf(const v1::ModalModelSummary& model, double speed_m_per_s) {
  v1::Material unit;
  unit.set_density_kg_per_m3(1);
  unit.set_young_pa(speed_m_per_s * speed_m_per_s);
  std::vector<double> decays;
  for (const ModeSound& mode : ModesOf(model, unit)) {
    if (mode.radiation_decay_per_s) decays.push_back(*mode.radiation_decay_per_s);
  }
  return decays;
}

/// Says why RadiationOf found nothing.
std::string WhyNoAir(const v1::ModalModelSummary& model, const std::string& name) {
  if (model.transfers().empty()) {
    return absl::StrCat("the model has no transfer yet; carillon transfer ", name,
                        " computes it, and then fit again");
  }
  return "the model's transfers are for another speed of sound than was found; create the model "
         "again with this material, and fit again";
}

absl::StatusOr<Source> ReadSource(const std::vector<std::string>& files) {
  Source source{.body = {}, .extracted = {}, .files = files, .no_air = {}};
  std::vector<std::string> recordings;
  for (const std::string& file : files) {
    if (!absl::EndsWithIgnoreCase(file, ".csv")) {
      recordings.push_back(file);
      continue;
    }
    ASSIGN_OR_RETURN(const auto modes, ReadModes(file));
    source.body.modes.insert(source.body.modes.end(), modes.begin(), modes.end());
  }
  if (!recordings.empty()) {
    ASSIGN_OR_RETURN(source.extracted, ExtractFrom(recordings));
    const auto& modes = source.extracted.modes;
    RETURN_IF_ERROR(fit::CheckModes(source.extracted.rings, modes));
    source.body.modes.insert(source.body.modes.end(), modes.begin(), modes.end());
  }
  std::ranges::sort(source.body.modes, {}, &fit::MeasuredMode::frequency_hz);
  return source;
}

v1::Material MaterialOf(const fit::MaterialFit& fit) {
  const auto rounded = [](double value) {
    return std::strtod(absl::StrFormat("%.6g", value).c_str(), nullptr);
  };
  v1::Material material;
  material.set_young_pa(rounded(fit.young_pa));
  material.set_poisson_ratio(std::round(fit.poisson_ratio * 1e4) / 1e4);
  material.set_density_kg_per_m3(rounded(fit.density_kg_per_m3));
  if (fit.laws.empty()) return material;
  const fit::DampingLaw& law = fit.laws[0];
  material.set_alpha1_s(law.alpha1_s);
  material.set_alpha2_per_s(law.alpha2_per_s);
  SetLossFactor(law.loss_factor, material);
  return material;
}

/// How an error of the mesh's size changes the Young's modulus that is found.
std::string SizeCaution(const FitOptions& options) {
  return options.settings.mass_kg
             ? "one percent in thickness is about three in E, one percent all over is one"
             : "one percent in size is two in E";
}

/// How well the material explains one of the bodies.
struct Agreement {
  size_t lines = 0, matched = 0;
  double mean = 0, rms = 0;  ///< of the relative deviations of the lines from their modes
};

Agreement AgreementOf(const fit::MaterialFit& fit, size_t body) {
  Agreement agreement;
  for (const fit::FittedLine& line : fit.lines) {
    if (line.body != body) continue;
    ++agreement.lines;
    if (!line.mode) continue;
    const double deviation = std::log(line.measured.frequency_hz / line.model_hz);
    ++agreement.matched;
    agreement.mean += deviation, agreement.rms += deviation * deviation;
  }
  const auto matched = static_cast<double>(std::max<size_t>(1, agreement.matched));
  agreement.mean /= matched;
  agreement.rms = std::sqrt(agreement.rms / matched);
  return agreement;
}

/// The named material nearest to the one that was found.
struct Nearest {
  std::string name;
  double young_ratio = 1, density_ratio = 1;  ///< of the found one over that of the named one
  double poisson_above = 0;                   ///< the found ratio less that of the named one
};

Nearest NearestOf(const fit::MaterialFit& fit) {
  Nearest nearest;
  double least = HUGE_VAL;
  for (const v1::CatalogueMaterial& named : Materials().materials()) {
    const double young = fit.young_pa / named.material().young_pa();
    const double density = fit.density_kg_per_m3 / named.material().density_kg_per_m3();
    const double distance = std::hypot(std::log(young), std::log(density));
    if (distance >= least) continue;
    least = distance;
    nearest = {.name = named.name(),
               .young_ratio = young,
               .density_ratio = density,
               .poisson_above = fit.poisson_ratio - named.material().poisson_ratio()};
  }
  return nearest;
}

/// Says so if the material is unlike all named ones, which a wrong size or sample rate makes it.
std::string FarCaution(const Nearest& nearest) {
  constexpr double kFar = 0.12;
  const double speed_squared = nearest.young_ratio / nearest.density_ratio;
  const double farthest =
      std::max(std::abs(std::log(speed_squared)), std::abs(std::log(nearest.density_ratio)));
  if (farthest < kFar) return "";
  return absl::StrFormat(
      "No named material is near: the nearest, %s, has %.2f times the E/rho and %.2f times the "
      "density. If the body is of a usual material, see its size, the unit of its mesh and its "
      "mass, and that the recordings state their true sample rate: 44100 in place of 48000 Hz "
      "makes "
      "E/rho 16 %% too small, the reverse 18 %% too great.",
      nearest.name, 1 / speed_squared, 1 / nearest.density_ratio);
}

/// Says so if Poisson's ratio is far from that of the nearest named material. Wrong proportions of
/// the mesh change the ratio.
std::string ProportionCaution(const fit::MaterialFit& fit, const Nearest& nearest) {
  constexpr double kFar = 0.04;
  if (std::abs(nearest.poisson_above) < kFar + 2 * fit.poisson_error) return "";
  return absl::StrFormat(
      "Poisson's ratio is %.3f, and %.3f that of %s, the nearest named material: see the "
      "proportions of the mesh, of which one percent can change it by 0.02.",
      fit.poisson_ratio, fit.poisson_ratio - nearest.poisson_above, nearest.name);
}

/// Says so if the level of the recordings was changed while they were made.
std::string GainCaution(const Extracted& extracted) {
  if (extracted.gain_fall_db == 0) return "";
  return absl::StrFormat(
      "The noise is %.0f dB quieter after the blows than before them. Unless another sound ended "
      "there, an automatic gain control, a gate or a reduction of noise changed the level, and the "
      "decays are not the body's: switch it off, and record again. The frequencies do not suffer.",
      extracted.gain_fall_db);
}

/// Says so if a recording is clipped.
std::string ClippedCaution(const Extracted& extracted) {
  if (extracted.clipped.empty()) return "";
  return absl::StrFormat(
      "%s stands at its greatest level for %.2g ms in all: it is clipped, which adds lines that no "
      "mode has. Record again with a lower level, or farther away.",
      extracted.clipped, 1000 * extracted.clipped_s);
}

/// Says so if the computed radiation makes the decays less like those of the recordings.
std::string AirCaution(const fit::MaterialFit& fit) {
  constexpr double kWorse = 1.05;
  if (fit.laws.empty() || fit.missed_without_air == 0 ||
      fit.laws[0].missed_by < kWorse * fit.missed_without_air) {
    return "";
  }
  return absl::StrFormat(
      "Without what the model radiates the law would miss the rates by x%.2f, with it by x%.2f: "
      "see that the mesh has the size of the body, and that nothing else changed the decays.",
      fit.missed_without_air, fit.laws[0].missed_by);
}

/// Says so if one of several bodies agrees worse than the others.
std::string AgreementCaution(const fit::MaterialFit& fit, const std::vector<Source>& sources,
                             size_t body) {
  constexpr double kWorse = 2;
  if (sources.size() == 1) return "";
  double least = HUGE_VAL;
  for (size_t b = 0; b < sources.size(); ++b) least = std::min(least, AgreementOf(fit, b).rms);
  const Agreement own = AgreementOf(fit, body);
  const bool few =
      static_cast<double>(own.matched) < fit::kLeastMatched * static_cast<double>(own.lines);
  if (own.rms <= kWorse * least && !few) return "";
  return absl::StrFormat(
      "%s agrees worse than the other bodies, by %d of %s, %.2g %% apart: see its size, and that "
      "its recordings and its material are its own.",
      sources[body].body.name, own.matched, Counted(own.lines, "line"), 100 * own.rms);
}

/// What to be cautious about in the recordings of a body.
std::vector<std::string> CautionsOf(const Extracted& extracted) {
  std::vector<std::string> cautions = {GainCaution(extracted), ClippedCaution(extracted)};
  std::erase(cautions, "");
  return cautions;
}

/// What to be cautious about, one sentence or more in each.
std::vector<std::string> CautionsOf(const fit::MaterialFit& fit,
                                    const std::vector<Source>& sources) {
  const Nearest nearest = NearestOf(fit);
  std::vector<std::string> cautions = {FarCaution(nearest), ProportionCaution(fit, nearest),
                                       AirCaution(fit)};
  for (size_t b = 0; b < sources.size(); ++b) {
    cautions.push_back(AgreementCaution(fit, sources, b));
    std::ranges::copy(CautionsOf(sources[b].extracted), std::back_inserter(cautions));
  }
  std::erase(cautions, "");
  return cautions;
}

std::string MaterialFileText(const fit::MaterialFit& fit, const std::vector<Source>& sources,
                             const FitOptions& options) {
  std::string text = "# A material that carillon material fit found.\n";
  for (const Source& source : sources) {
    absl::StrAppend(&text, "# Body ", source.body.name, ": ", absl::StrJoin(source.files, ", "),
                    "\n");
  }
  absl::StrAppendFormat(&text,
                        "# E/rho %.5g m^2/s^2 +- %.2g %%, Poisson's ratio +- %.2g (two standard "
                        "errors); %d lines matched, %.2g %% apart,\n"
                        "# the next best match %.1f nepers behind. A wrong size of the mesh hides "
                        "in E: %s; wrong proportions hide in Poisson's ratio.\n",
                        fit.young_over_density, 200 * fit.young_over_density_error,
                        2 * fit.poisson_error, fit.matched_count, 100 * fit.rms, fit.log_odds,
                        SizeCaution(options));
  if (fit.laws.empty()) {
    absl::StrAppendFormat(
        &text,
        "# The decays of %d of the matched lines are known, and no damping was found: fit again "
        "with --damping, or give --loss-factor beside this file.\n",
        fit.decay_count);
  } else {
    absl::StrAppendFormat(&text,
                          "# Damping: %s, +- %.2g %% (two standard errors), within a factor of "
                          "%.2f of half of the decay rates, known from %.0f to %.0f Hz.\n",
                          fit.laws[0].Name(), 200 * fit.damping_error, fit.laws[0].missed_by,
                          fit.decays_from_hz, fit.decays_to_hz);
  }
  for (const Source& source : sources) {
    if (fit.laws.empty() || source.no_air.empty()) continue;
    absl::StrAppend(&text, "# The damping includes what ", source.body.name,
                    " radiates: ", source.no_air, ".\n");
  }
  for (const std::string& caution : CautionsOf(fit, sources))
    absl::StrAppend(&text, "# ", caution, "\n");
  return absl::StrCat(text, MaterialOf(fit).DebugString());
}

Json ToJson(const fit::MeasuredMode& mode) {
  return {{"frequency_hz", mode.frequency_hz}, {"frequency_error_hz", mode.frequency_error_hz},
          {"decay_per_s", mode.decay_per_s},   {"decay_error_per_s", mode.decay_error_per_s},
          {"level_db", mode.level_db},         {"signal_to_noise_db", mode.signal_to_noise_db},
          {"near_room", mode.near_room}};
}

Json ToJson(const fit::DampingLaw& law) {
  Json points = Json::array();
  for (const LossFactorPoint& point : law.loss_factor) {
    points.push_back({{"frequency_hz", point.frequency_hz}, {"loss_factor", point.loss_factor}});
  }
  return {{"name", law.Name()},    {"alpha1_s", law.alpha1_s},   {"alpha2_per_s", law.alpha2_per_s},
          {"loss_factor", points}, {"missed_by", law.missed_by}, {"criterion", law.criterion}};
}

Json ToJson(const fit::FittedLine& line, const std::vector<Source>& sources) {
  Json json = ToJson(line.measured);
  json["body"] = sources[line.body].body.name;
  if (!line.mode) return json;
  json["mode"] = *line.mode + 1;
  json["model_hz"] = line.model_hz;
  json["radiation_per_s"] = line.radiation_per_s;
  json["law_per_s"] = line.law_per_s;
  json["law_error_per_s"] = line.law_error_per_s;
  return json;
}

/// The frequencies of all modes of a body, with the material that was found.
Json ToJson(const fit::FittedBody& body, const fit::MaterialFit& fit) {
  Json hz = Json::array();
  for (size_t mode = 0; mode < body.lines.eigenvalues.size(); ++mode) {
    hz.push_back(std::sqrt(fit.young_over_density) *
                 body.lines.HertzAtUnitSpeed(mode, fit.poisson_ratio));
  }
  return {{"name", body.name}, {"modes_hz", hz}};
}

Json ToJson(const fit::MaterialFit& fit, const std::vector<Source>& sources) {
  Json lines = Json::array(), candidates = Json::array(), laws = Json::array(),
       bodies = Json::array();
  for (const Source& source : sources) {
    bodies.push_back(ToJson(source.body, fit));
    bodies.back()["air_subtracted"] = source.no_air.empty();
  }
  for (const fit::FittedLine& line : fit.lines) lines.push_back(ToJson(line, sources));
  for (const fit::DampingLaw& law : fit.laws) laws.push_back(ToJson(law));
  for (const fit::Match& match : fit.candidates) {
    candidates.push_back({{"young_over_density", match.speed_m_per_s * match.speed_m_per_s},
                          {"poisson_ratio", match.poisson_ratio},
                          {"matched", match.lines.size()},
                          {"rms", match.rms},
                          {"score", match.score}});
  }
  return {{"young_over_density", fit.young_over_density},
          {"young_over_density_error", fit.young_over_density_error},
          {"young_pa", fit.young_pa},
          {"density_kg_per_m3", fit.density_kg_per_m3},
          {"poisson_ratio", fit.poisson_ratio},
          {"poisson_error", fit.poisson_error},
          {"matched", fit.matched_count},
          {"rms", fit.rms},
          {"log_odds", fit.log_odds},
          {"decay_count", fit.decay_count},
          {"decays_from_hz", fit.decays_from_hz},
          {"decays_to_hz", fit.decays_to_hz},
          {"laws", laws},
          {"damping_error", fit.damping_error},
          {"nearest_material", NearestOf(fit).name},
          {"cautions", CautionsOf(fit, sources)},
          {"lines", lines},
          {"bodies", bodies},
          {"candidates", candidates}};
}

/// The reverberation time, or null.
Json RoomT60(const fit::Room& room) {
  return room.share == 0 ? Json() : Json(std::log(1000) / room.decay_per_s);
}

/// Says in which room the recordings were made, if it was told apart.
void PrintRoom(const fit::Room& room) {
  if (room.share == 0) {
    absl::PrintF("room        none that could be told apart\n");
    return;
  }
  absl::PrintF("room        T60 %.2g s, taken off; modes with * decay at about its rate\n",
               std::log(1000) / room.decay_per_s);
}

void PrintModes(const std::vector<fit::MeasuredMode>& modes) {
  absl::PrintF("%12s %9s %11s %9s %8s %9s %8s\n", "Hz", "+- Hz", "decay 1/s", "+- 1/s", "T60 s",
               "level dB", "S/N dB");
  for (const fit::MeasuredMode& mode : modes) {
    const double t60 = mode.decay_per_s > 0 ? std::log(1000) / mode.decay_per_s : HUGE_VAL;
    absl::PrintF("%12.3f %9.3f %11.3f %9.3f %8.3g %9.1f %8.1f%s\n", mode.frequency_hz,
                 mode.frequency_error_hz, mode.decay_per_s, mode.decay_error_per_s, t60,
                 mode.level_db, mode.signal_to_noise_db, mode.near_room ? " *" : "");
  }
}

void PrintLines(const fit::MaterialFit& fit, const std::vector<Source>& sources) {
  absl::PrintF("\n%-12s %12s %11s %9s %5s %12s %8s %11s %9s\n", "body", "measured Hz", "decay 1/s",
               "+- 1/s", "mode", "model Hz", "apart %", "model 1/s", "+- 1/s");
  for (const fit::FittedLine& line : fit.lines) {
    absl::PrintF("%-12s %12.3f %11.3f %9.3f", sources[line.body].body.name,
                 line.measured.frequency_hz, line.measured.decay_per_s,
                 line.measured.decay_error_per_s);
    if (line.mode) {
      absl::PrintF(" %5d %12.3f %8.2f %11.3f %9.3f", *line.mode + 1, line.model_hz,
                   100 * std::log(line.measured.frequency_hz / line.model_hz), line.law_per_s,
                   line.law_error_per_s);
    }
    absl::PrintF("%s\n", line.measured.near_room ? " *" : "");
  }
}

void PrintFit(const fit::MaterialFit& fit, const std::vector<Source>& sources,
              const FitOptions& options) {
  absl::PrintF("%d of %s matched, %.2g %% apart; the next best match is %.1f nepers behind\n",
               fit.matched_count, Counted(fit.lines.size(), "line"), 100 * fit.rms, fit.log_odds);
  absl::PrintF("E/rho       %.5g m^2/s^2 +- %.2g %% (two standard errors)\n",
               fit.young_over_density, 200 * fit.young_over_density_error);
  absl::PrintF("E           %.5g GPa at %.5g kg/m^3\n", fit.young_pa / 1e9, fit.density_kg_per_m3);
  absl::PrintF("Poisson     %.4f +- %.4f\n", fit.poisson_ratio, 2 * fit.poisson_error);
  const Nearest nearest = NearestOf(fit);
  absl::PrintF("nearest     %s: E %+.2g %%, density %+.2g %%, Poisson %+.3f\n", nearest.name,
               100 * (nearest.young_ratio - 1), 100 * (nearest.density_ratio - 1),
               nearest.poisson_above);
  for (size_t b = 0; sources.size() > 1 && b < sources.size(); ++b) {
    const Agreement agreement = AgreementOf(fit, b);
    absl::PrintF("%-11s %d of %s matched, %.2g %% apart, %+.2g %% on the average\n",
                 sources[b].body.name, agreement.matched, Counted(agreement.lines, "line"),
                 100 * agreement.rms, 100 * agreement.mean);
  }
  if (fit.laws.empty()) {
    absl::PrintF(
        "damping     not found: the decays of %d of %s are known, and the others are hidden by the "
        "room or the noise, or not in the table, or no law explains them; record nearer and where "
        "there is less echo, or name the law (--damping)\n",
        fit.decay_count, Counted(fit.matched_count, "matched line"));
  }
  for (size_t k = 0; k < fit.laws.size(); ++k) {
    const fit::DampingLaw& law = fit.laws[k];
    std::string figures;
    for (const LossFactorPoint& point : law.loss_factor) {
      absl::StrAppendFormat(&figures, " %.0f:%.3g", point.frequency_hz, point.loss_factor);
    }
    if (law.kind == fit::DampingKind::kRayleigh) {
      figures = absl::StrFormat(" alpha1 %.3g s, alpha2 %.3g 1/s", law.alpha1_s, law.alpha2_per_s);
    }
    absl::PrintF("%-11s %s (%s, misses rates by x%.2f)\n", k == 0 ? "damping" : "  or",
                 absl::StripAsciiWhitespace(figures), law.Name(), law.missed_by);
  }
  if (!fit.laws.empty()) {
    absl::PrintF(
        "            +- %.2g %% (two standard errors) by the decays of %s, known from %.0f to %.0f "
        "Hz; beyond, it is a guess\n",
        200 * fit.damping_error, Counted(fit.decay_count, "line"), fit.decays_from_hz,
        fit.decays_to_hz);
  }
  for (const Source& source : sources) {
    if (!fit.laws.empty() && !source.no_air.empty()) {
      absl::PrintF("air         what %s radiates is in the damping: %s\n", source.body.name,
                   source.no_air);
    }
    if (!source.extracted.rings.empty()) PrintRoom(source.extracted.room);
  }
  PrintLines(fit, sources);
  absl::PrintF(
      "\nA wrong size of the mesh hides in E and cannot be seen: %s. Wrong proportions hide in "
      "Poisson's ratio: one percent in the width of a bar is 0.02.\n",
      SizeCaution(options));
  for (const std::string& caution : CautionsOf(fit, sources)) absl::PrintF("%s\n", caution);
}

/// Writes what the matched modes leave of the first strike, and returns its shares of the energy.
absl::StatusOr<std::vector<fit::ResidualShare>> WriteResidual(const std::string& path,
                                                              const Source& source,
                                                              const fit::MaterialFit& fit) {
  std::vector<fit::MeasuredMode> matched;
  for (const fit::FittedLine& line : fit.lines) {
    if (line.body == 0 && line.mode) matched.push_back(line.measured);
  }
  const fit::Ring& ring = source.extracted.rings[0];
  const fit::Residual residual = fit::ResidualOf(ring, 0, matched);
  ASSIGN_OR_RETURN(
      WaveFile file,
      WaveFile::Create(path, {.sample_rate_hz = static_cast<uint32_t>(ring.sample_rate_hz)}));
  RETURN_IF_ERROR(file.Write(residual.samples));
  RETURN_IF_ERROR(file.Finish());
  for (const fit::ResidualShare& share : residual.shares) {
    absl::FPrintF(stderr, "%s: %.3g %% of the energy from %g to %g ms is no matched mode's\n", path,
                  100 * share.share, 1000 * share.from_s, 1000 * share.to_s);
  }
  return residual.shares;
}

}  // namespace

absl::Status ExtractModesOf(const ExtractOptions& options, bool json) {
  ASSIGN_OR_RETURN(const Extracted extracted, ExtractFrom(options.recordings));
  if (extracted.modes.empty()) RETURN_IF_ERROR(fit::CheckModes(extracted.rings, extracted.modes));
  if (!options.out.empty()) RETURN_IF_ERROR(WriteModes(options.out, extracted.modes));
  if (json) {
    Json modes = Json::array();
    for (const fit::MeasuredMode& mode : extracted.modes) modes.push_back(ToJson(mode));
    absl::PrintF("%s\n", Json{{"strikes", extracted.rings.size()},
                              {"room_t60_s", RoomT60(extracted.room)},
                              {"gain_fall_db", extracted.gain_fall_db},
                              {"clipped_s", extracted.clipped_s},
                              {"modes", modes}}
                             .dump());
  } else {
    PrintModes(extracted.modes);
    PrintRoom(extracted.room);
    for (const std::string& caution : CautionsOf(extracted)) absl::PrintF("%s\n", caution);
  }
  return absl::OkStatus();
}

absl::Status FitMaterialTo(const client::Client& daemon, const FitOptions& options, bool json) {
  std::vector<std::vector<std::string>> bodies = {{options.model}};
  bodies[0].insert(bodies[0].end(), options.recordings.begin(), options.recordings.end());
  if (!options.modes.empty()) bodies[0].push_back(options.modes);
  bodies.insert(bodies.end(), options.others.begin(), options.others.end());
  std::vector<Source> sources;
  std::vector<v1::ModalModelSummary> models;
  for (const std::vector<std::string>& words : bodies) {
    ASSIGN_OR_RETURN(v1::ModalModelSummary model, FindSummary(daemon, words[0]));
    ASSIGN_OR_RETURN(fit::ModelLines lines, LinesOf(model));
    ASSIGN_OR_RETURN(Source source, ReadSource({words.begin() + 1, words.end()}));
    source.body.name = words[0];
    source.body.lines = std::move(lines);
    source.body.volume_m3 = model.header().volume_m3();
    sources.push_back(std::move(source));
    models.push_back(std::move(model));
  }
  const auto fitted = [&] {
    std::vector<fit::FittedBody> fitted_bodies;
    fitted_bodies.reserve(sources.size());
    for (const Source& source : sources) fitted_bodies.push_back(source.body);
    return fit::FitMaterial(fitted_bodies, options.settings);
  };
  absl::StatusOr<fit::MaterialFit> first = fitted();
  if (!first.ok()) {
    for (const Source& source : sources) {
      for (const std::string& caution : CautionsOf(source.extracted)) {
        absl::FPrintF(stderr, "warning: %s\n", caution);
      }
    }
    return first.status();
  }
  fit::MaterialFit fit = *std::move(first);
  // What each mode radiates is known once the speed of sound is.
  for (size_t b = 0; b < sources.size(); ++b) {
    sources[b].body.radiation = RadiationOf(models[b], std::sqrt(fit.young_over_density));
    if (sources[b].body.radiation.empty()) {
      sources[b].no_air = WhyNoAir(models[b], sources[b].body.name);
    }
  }
  ASSIGN_OR_RETURN(fit, fitted());
  if (!options.out.empty())
    RETURN_IF_ERROR(WriteText(options.out, MaterialFileText(fit, sources, options)));
  std::vector<fit::ResidualShare> rest;
  if (!options.residual.empty() && !sources[0].extracted.rings.empty()) {
    ASSIGN_OR_RETURN(rest, WriteResidual(options.residual, sources[0], fit));
  }
  if (json) {
    Json found = ToJson(fit, sources);
    for (const fit::ResidualShare& share : rest) {
      found["residual"].push_back(
          {{"from_s", share.from_s}, {"to_s", share.to_s}, {"share", share.share}});
    }
    absl::PrintF("%s\n", found.dump());
  } else {
    PrintFit(fit, sources, options);
  }
  return absl::OkStatus();
}

}  // namespace carillon::cli
