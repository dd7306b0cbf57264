# SPDX-License-Identifier: Apache-2.0
"""The recorded steel bar: its material fitted, and its sound rendered change by change."""

import dataclasses
import itertools
import json
import math
import statistics

import numpy

import catalogue
import likeness
import microphone
import programs
import rings

RECORDING = "steel_bar_114x25.4x3.12mm.wav"
SIZE_M = (0.11436, 0.02544, 0.00312)
DENSITY_KG_PER_M3 = 7855  # 71.3 g
SPAN_S = 0.35  # the part of the recording that is compared
MATERIAL = "structural_steel"
# The lowest frequencies to the highest that the recording holds.
BAND_HZ = "20:22000"
# The fit corrects the modes of a coarse model by their estimated errors; the model that is rendered is finer.
FIT_ACCURACY, SOUND_ACCURACY = "0.5%", "0.08%"
# The modes whose decay is compared; those below decay too slowly for a recording of 0.37 s.
HIGH_HZ = (6879, 7020, 10947, 11306, 15350, 16719)
# A ring that is farther from the place of one of these modes is another.
FARTHEST = 0.01
HARD_S = 5e-5
RADIATION_ACCURACY_DB, RADIATION_BUDGET_S = 0.3, 120
# That of a hammer of 20 g that meets the bar at 1 m/s. The daemon's own contact is the shorter, the harder the blow.
IMPULSE_NEWTON_SECONDS = 0.03
# How often the steps of the grid of struck places are halved around the best.
HALVINGS = 4


@dataclasses.dataclass
class Variant:
    """One way to render the bar."""

    name: str
    heard: programs.Heard
    duration_s: float  # None: the daemon's own choice
    microphones: microphone.Microphones = None  # None: the mean over all directions at 1 m


@dataclasses.dataclass
class Result:
    name: str
    point_m: tuple
    microphone: tuple  # distance, polar angle, azimuth; None: the mean over all directions
    mrstft: float
    octaves_db: float
    decays: dict  # decay rate by the Hz of HIGH_HZ, of those that can be measured
    sound: object
    summary: dict


def decompose(studio, young_pa, poisson_ratio, accuracy):
    """The name of the bar's stored model."""
    import meshes

    mesh, out = studio.folder / "bar.obj", studio.folder / f"bar-{poisson_ratio:.4f}.model"
    mesh.write_bytes(meshes.obj(*meshes.box(SIZE_M, low=[-side / 2 for side in SIZE_M])))
    studio.decompose(mesh, out, "--young", young_pa, "--poisson", poisson_ratio, "--density", DENSITY_KG_PER_M3,
                     "--accuracy", accuracy, "--band", BAND_HZ)
    return studio.import_model(out)


def fit_material(studio, model, path):
    """What `carillon material fit` finds for a stored model of the bar."""
    return json.loads(studio.command("--json", "material", "fit", model.split("/")[-1], path, "--density",
                                     DENSITY_KG_PER_M3))


def first_fit(studio, path):
    """The fit by a model of the preset's Poisson's ratio."""
    preset = catalogue.read()[MATERIAL]
    return fit_material(studio, decompose(studio, preset.young_pa, preset.poisson_ratio, FIT_ACCURACY), path)


def fitted_damping(answer):
    """The fit's law of damping, in the form of a material of the catalogue."""
    law = answer["laws"][0]
    points = [(point["frequency_hz"], point["loss_factor"]) for point in law["loss_factor"]]
    return catalogue.Material(name="fitted", young_pa=answer["young_pa"], poisson_ratio=answer["poisson_ratio"],
                              density_kg_per_m3=DENSITY_KG_PER_M3, alpha1_s=law["alpha1_s"],
                              alpha2_per_s=law["alpha2_per_s"], loss_factor=points, source="the recording")


def nearest_sum(recording, modes):
    """The sum of modes of (Hz, decay rate) with the amplitudes and phases that are nearest to the recording."""
    hz, decays = numpy.array(modes).T
    time = numpy.arange(len(recording)) / rings.RATE_HZ
    turning = numpy.exp(numpy.outer(2j * math.pi * hz - decays, time))
    basis = numpy.concatenate([turning.real, turning.imag]).T
    return basis @ numpy.linalg.lstsq(basis, recording, rcond=None)[0]


def bounds(recording, answer):
    """Yields (name, MRSTFT) of the nearest sums of the matched modes: no struck place and no microphone come nearer."""
    lines = [line for line in answer["lines"] if "mode" in line]
    measured_hz, model_hz = ([line[key] for line in lines] for key in ("frequency_hz", "model_hz"))
    heard, law = [max(0.0, line["decay_per_s"]) for line in lines], [line["law_per_s"] for line in lines]
    for name, hz, decays in (("frequencies and decays as recorded", measured_hz, heard),
                             ("the fit's decays", measured_hz, law), ("the fit's frequencies", model_hz, heard),
                             ("the fit's frequencies and decays", model_hz, law)):
        yield name, likeness.mrstft(recording, nearest_sum(recording, list(zip(hz, decays))))


def places():
    """A quarter of the upper face; the bar is symmetrical."""
    length, width, height = SIZE_M
    return [(length / 2 * x / 12, width / 2 * y / 2, height / 2) for x in range(13) for y in range(3)]


def places_around(point_m, halvings):
    """The places beside one, at the grid's steps halved so often. In the symmetrical places of the grid whole families
    of modes are silent, and a little beside them they are not."""
    length, width, height = SIZE_M
    step = [length / 24 / 2**halvings, width / 4 / 2**halvings]
    around = {tuple(min(max(at + sign * by, 0), most) for at, sign, by, most in
                    zip(point_m, signs, step, (length / 2, width / 2)))
              for signs in itertools.product((-1, 0, 1), repeat=2)}
    return [(*at, height / 2) for at in sorted(around - {tuple(point_m[:2])})]


def strike(studio, variant, point_m):
    """The bar struck once, downwards."""
    blow = programs.Blow(point_m, (0, 0, -IMPULSE_NEWTON_SECONDS), variant.duration_s)
    return studio.render(variant.heard, [blow], SPAN_S)


def variants(studio, path, recording, answer):
    """Yields the ways to render the bar, each with one more change than the one before. `answer` is the first fit."""
    preset = catalogue.read()[MATERIAL]
    young_pa, poisson_ratio = answer["young_pa"], answer["poisson_ratio"]

    def heard(name, young, damping, **laws):
        figures = {"young_pa": young, "density_kg_per_m3": DENSITY_KG_PER_M3, **damping}
        return programs.Heard(name, figures, **laws)

    own_loss = programs.loss_factor(preset.loss_factor)
    name = decompose(studio, young_pa, poisson_ratio, SOUND_ACCURACY)
    yield Variant("E and nu fitted, contact of 0.05 ms", heard(name, young_pa, own_loss), HARD_S)
    material = heard(name, young_pa, own_loss).material
    studio.radiate(name, material, "--accuracy", RADIATION_ACCURACY_DB, "--budget", RADIATION_BUDGET_S)
    # The recording begins after the blow, and so after the sound of the bar's acceleration.
    yield Variant("and radiation", heard(name, young_pa, own_loss, paper_coupling=False, modes_only=True), HARD_S)
    # Radiation is known now, so that the law of damping is that of the bar itself.
    answer = fit_material(studio, name, path)
    damping = fitted_damping(answer)
    fitted = {**programs.loss_factor(damping.loss_factor), "alpha1_s": damping.alpha1_s,
              "alpha2_per_s": damping.alpha2_per_s}
    own = heard(name, young_pa, own_loss, paper_coupling=False, gaussian=False, modes_only=True)
    yield Variant("and the daemon's own contact", own, None)
    yield Variant("the same with the acceleration noise", dataclasses.replace(own, modes_only=False), None)
    own = heard(name, young_pa, fitted, paper_coupling=False, gaussian=False, modes_only=True)
    yield Variant("and the fitted damping, without the acceleration noise", own, None)
    import scripted  # needs the paths of `use`
    transfer = scripted.read_transfer(studio.export(name))
    yield Variant("and a microphone near by", own, None,
                  microphone.Microphones(transfer, damping, young_pa, DENSITY_KG_PER_M3))
    print("\nNearest sums of the matched modes:",
          ", ".join(f"{bound} {distance:.2f}" for bound, distance in bounds(recording, answer)))


def decays_of(sound):
    """The decay rates of the high modes that can be measured in a sound."""
    found = {hz: rings.ring_near(sound, hz) for hz in HIGH_HZ}
    return {hz: ring.decay_per_s for hz, ring in found.items()
            if ring and abs(ring.hz / hz - 1) < FARTHEST and ring.decay_per_s > 0}


def takes(studio, variant, points):
    """(point, microphone, sound, summary) of each strike that is tried: its place is not known."""
    return [(point_m, None, *strike(studio, variant, point_m)) for point_m in points]


def nearest(recording, tried):
    """(MRSTFT, take) of the take that resembles the recording most."""
    return min(((likeness.mrstft(recording, take[2]), take) for take in tried), key=lambda pair: pair[0])


def nearest_microphone(recording, microphones, tried, best):
    """(MRSTFT, take) for the microphone that is best for the best strike, and for the strike that is best for it."""
    point_m, _, sound, summary = best
    _, (_, place, _, _) = nearest(recording, ((point_m, place, heard, summary)
                                              for place, heard in microphones.hear(sound)))
    return nearest(recording, heard_at(microphones, place, tried))


def heard_at(microphones, place, tried):
    """The takes as a microphone hears them; as they are, where there is none."""
    if place is None:
        return tried
    return [(point_m, at, heard, summary) for point_m, _, sound, summary in tried
            for at, heard in microphones.hear(sound) if tuple(at) == tuple(place)]


def measure(studio, recording, variant):
    """The Result for the strike, and the microphone, that resemble the recording most."""
    tried = takes(studio, variant, places())
    found = nearest(recording, tried)

    def refine(found):
        for halvings in range(HALVINGS):
            more = takes(studio, variant, places_around(found[1][0], halvings))
            tried.extend(more)
            heard = heard_at(variant.microphones, found[1][1], more)
            found = min(found, nearest(recording, heard), key=lambda pair: pair[0])
        return found

    found = refine(found)
    if variant.microphones:
        found = refine(nearest_microphone(recording, variant.microphones, tried, found[1]))
    distance, best = found
    point_m, place, sound, summary = best
    octaves_db = likeness.octave_error_db(recording, sound, rings.RATE_HZ)
    return Result(variant.name, point_m, place, distance, octaves_db, decays_of(sound), sound, summary)


def decay_factor(recorded, rendered):
    """Median factor by which decay rates are missed, either way; None if none could be measured."""
    factors = [math.exp(abs(math.log(rate / recorded[hz]))) for hz, rate in rendered.items() if hz in recorded]
    return statistics.median(factors) if factors else None
