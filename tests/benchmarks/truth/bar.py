# SPDX-License-Identifier: Apache-2.0
"""The recorded steel bar: its material fitted, and its sound rendered change by change."""

import dataclasses
import math
import pathlib
import statistics

import catalogue
import fit
import likeness
import microphone
import programs
import rings

RECORDING = "steel_bar_114x25.4x3.12mm.wav"
SIZE_M = (0.11436, 0.02544, 0.00312)
DENSITY_KG_PER_M3 = 7855  # 71.3 g
SPAN_S = 0.35  # the part of the recording that is compared
MATERIAL = "structural_steel"
# The lowest frequencies to the highest that the recording holds. The probes of Poisson's ratio lie below 0.28, where
# the third bending mode and the second torsional one change places.
BAND_HZ, PROBES = "20:22000", (0.22, 0.245, 0.27)
# Probes are corrected by their estimated error; what is heard is decomposed as exactly as its comparison needs.
PROBE_ACCURACY, SOUND_ACCURACY = "0.5%", "0.08%"
# The modes whose decay is compared; those below decay too slowly for a recording of 0.37 s.
HIGH_HZ = (6879, 7020, 10947, 11306, 15350, 16719)
# The catalogue up to version 0.1: a loss factor of 2e-4 at 1 kHz, half of it from each of Rayleigh's terms.
RAYLEIGH = {"alpha1_s": 1.592e-8, "alpha2_per_s": 0.6283}
SOFT_S, HARD_S = 4e-4, 5e-5
RADIATION_ACCURACY_DB, RADIATION_BUDGET_S = 0.3, 120
# That of a hammer of 20 g that meets the bar at 1 m/s. The daemon's own contact is the shorter, the harder the blow.
IMPULSE_NEWTON_SECONDS = 0.03


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


def mesh(folder):
    import meshes

    path = pathlib.Path(folder) / "bar.obj"
    path.write_bytes(meshes.obj(*meshes.box(SIZE_M, low=[-side / 2 for side in SIZE_M])))
    return path


def decompose(folder, young_pa, poisson_ratio, accuracy, *options):
    """(model file, report) of the bar."""
    out = pathlib.Path(folder) / f"bar-{poisson_ratio:.4f}.model"
    return out, programs.decompose(mesh(folder), out, "--young", young_pa, "--poisson", poisson_ratio, "--density",
                                   DENSITY_KG_PER_M3, "--accuracy", accuracy, "--band", BAND_HZ, *options)


def frequencies_hz(report):
    """With the estimated error of each taken off: finite elements are too stiff."""
    return [mode["frequency_hz"] * (1 - mode["estimated_error"]) for mode in report["modes"]]


def fit_material(folder, recorded):
    """(Young's modulus, Fit) of the recorded rings."""
    preset = catalogue.read()[MATERIAL].young_pa
    found = fit.fit_material([ring.hz for ring in recorded],
                             lambda nu: frequencies_hz(decompose(folder, preset, nu, PROBE_ACCURACY)[1]), PROBES)
    return preset * found.young_scale, found


def places():
    """A quarter of the upper face; the bar is symmetrical."""
    length, width, height = SIZE_M
    return [(length / 2 * x / 12, width / 2 * y / 2, height / 2) for x in range(13) for y in range(3)]


def strike(studio, variant, point_m):
    """The bar struck once, downwards."""
    blow = programs.Blow(point_m, (0, 0, -IMPULSE_NEWTON_SECONDS), variant.duration_s)
    return studio.render(variant.heard, [blow], SPAN_S)


def variants(studio, folder, young_pa, poisson_ratio):
    """Yields the ways to render the bar, each with one more change than the one before."""
    preset = catalogue.read()[MATERIAL]

    def model(young, ratio):
        return studio.import_model(decompose(folder, young, ratio, SOUND_ACCURACY)[0])

    def heard(name, young, damping, **laws):
        figures = {"young_pa": young, "density_kg_per_m3": DENSITY_KG_PER_M3, **damping}
        return programs.Heard(name, figures, **laws)

    own_loss = programs.loss_factor(preset.loss_factor)
    name = model(preset.young_pa, preset.poisson_ratio)
    yield Variant("version 0.1: preset, soft contact", heard(name, preset.young_pa, RAYLEIGH), SOFT_S)
    yield Variant("contact of 0.05 ms", heard(name, preset.young_pa, RAYLEIGH), HARD_S)
    name = model(young_pa, poisson_ratio)
    yield Variant("and E and nu fitted", heard(name, young_pa, RAYLEIGH), HARD_S)
    yield Variant("and the catalogue's loss factor", heard(name, young_pa, own_loss), HARD_S)
    material = heard(name, young_pa, own_loss).material
    if not studio.radiate(name, material, "--accuracy", RADIATION_ACCURACY_DB, "--budget", RADIATION_BUDGET_S):
        print("these programs cannot compute radiation: the rest of the table is missing")
        return
    # The recording begins after the blow, and so after the sound of the bar's acceleration.
    yield Variant("and radiation", heard(name, young_pa, own_loss, paper_coupling=False, modes_only=True), HARD_S)
    own = heard(name, young_pa, own_loss, paper_coupling=False, gaussian=False, modes_only=True)
    yield Variant("and the daemon's own contact", own, None)
    yield Variant("the same with the acceleration noise", dataclasses.replace(own, modes_only=False), None)
    transfer = microphone.read(studio.export(name))
    yield Variant("and a microphone near by", own, None,
                  microphone.Microphones(transfer, preset, young_pa, DENSITY_KG_PER_M3))


def decays_of(sound):
    """The decay rates of the high modes that can be measured in a sound."""
    found = {hz: rings.ring_near(sound, hz) for hz in HIGH_HZ}
    return {hz: ring.decay_per_s for hz, ring in found.items()
            if ring and abs(ring.hz / hz - 1) < fit.FITTED and ring.decay_per_s > 0}


def takes(studio, variant):
    """Yields (point, microphone, sound, summary) of each strike that is tried: its place is not known."""
    for point_m in places():
        sound, summary = strike(studio, variant, point_m)
        if not variant.microphones:
            yield point_m, None, sound, summary
            continue
        for place, heard in variant.microphones.hear(sound):
            yield point_m, tuple(place), heard, summary


def measure(studio, recording, variant):
    """The Result for the strike, and the microphone, that resemble the recording most."""
    best = None
    for point_m, place, sound, summary in takes(studio, variant):
        distance = likeness.mrstft(recording, sound)
        if best is None or distance < best.mrstft:
            best = Result(variant.name, point_m, place, distance, 0, {}, sound, summary)
    best.octaves_db = likeness.octave_error_db(recording, best.sound, rings.RATE_HZ)
    best.decays = decays_of(best.sound)
    return best


def decay_factor(recorded, rendered):
    """Median factor by which decay rates are missed, either way; None if none could be measured."""
    factors = [math.exp(abs(math.log(rate / recorded[hz]))) for hz, rate in rendered.items() if hz in recorded]
    return statistics.median(factors) if factors else None
