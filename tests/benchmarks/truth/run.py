#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How true Carillon sounds: materials beside recorded bodies, a recorded bar, five drops.

    run.py --build BUILD [--recordings FOLDER] [--parts materials,loudness,bar,drops] [--pictures FOLDER]

Prints Markdown tables and draws spectrograms. deploy/truth.sh installs what this needs.
"""

import math
import pathlib
import sys
import tempfile

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import bench  # noqa: E402
import bar  # noqa: E402
import drops  # noqa: E402
import likeness  # noqa: E402
import loudness  # noqa: E402
import materials  # noqa: E402
import programs  # noqa: E402
import rings  # noqa: E402

WINDOW, RANGE_DB = 512, 70


def draw(sounds, path, seconds):
    """Draws the spectrogram of each of [(title, samples)], on a scale of its own loudest point, to a PNG file."""
    pyplot = bench.pyplot()
    columns = 4
    rows = math.ceil(len(sounds) / columns)
    figure, axes = pyplot.subplots(rows, columns, figsize=(3.1 * columns, 2.1 * rows), sharex=True, sharey=True,
                                   squeeze=False)
    for axis in axes.flat[len(sounds):]:
        axis.axis("off")
    for axis, (title, samples) in zip(axes.flat, sounds):
        shown = numpy.zeros(int(seconds * rings.RATE_HZ))
        shown[:min(len(shown), len(samples))] = samples[:len(shown)]
        noise = 1e-12 * numpy.random.default_rng(1).standard_normal(len(shown))  # no logarithm of zero
        power, _, _, image = axis.specgram(shown + noise, WINDOW, rings.RATE_HZ, noverlap=3 * WINDOW // 4,
                                           cmap="inferno")
        loudest = 10 * numpy.log10(power.max())
        image.set_clim(loudest - RANGE_DB, loudest)
        axis.set_title(title, fontsize=8)
        axis.set_ylim(0, 20000)
        axis.set_yticks(range(0, 20001, 5000), [f"{khz} kHz" for khz in range(0, 21, 5)], fontsize=7)
        axis.tick_params(axis="x", labelsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    pyplot.close(figure)
    print(f"drawn: {path}\n")


def print_table(lines):
    print("\n".join(lines), end="\n\n", flush=True)


def show_materials(_):
    for title, lines in materials.tables().items():
        print(f"## {title}\n")
        print_table(lines)


def show_loudness(options):
    print("## Loudness by mode: radiation over the paper's coupling\n")
    bench.print_head(*loudness.HEAD)
    with tempfile.TemporaryDirectory(prefix="carillon-") as folder:
        for name, surface, material in loudness.six_bodies():
            difference = loudness.measure(options.build, pathlib.Path(folder), surface, material)
            bench.print_row(name, material, *difference.line())
    print()


def fit_lines(answer):
    yield (f"E {answer['young_pa'] / 1e9:.2f} GPa, nu {answer['poisson_ratio']:.4f}; {answer['matched']} frequencies "
           f"within {100 * answer['rms']:.3f} % r.m.s.\n")
    yield from bench.head("recorded, Hz", "fitted, Hz", "difference, %")
    for line in answer["lines"]:
        if "mode" in line:
            ring, mode = line["frequency_hz"], line["model_hz"]
            yield bench.row(f"{ring:.1f}", f"{mode:.1f}", f"{100 * (mode / ring - 1):+.3f}")


def result_line(result, recorded):
    factor = bar.decay_factor(recorded, result.decays)
    decays = [f"{result.decays[hz]:.3g}" if hz in result.decays else "-" for hz in bar.HIGH_HZ]
    return bench.row(result.name, f"{result.mrstft:.2f}", f"{result.octaves_db:.1f}",
                         "-" if factor is None else f"{factor:.2f}", *decays,
                         "x".join(f"{1000 * x:.1f}" for x in result.point_m[:2]), microphone_words(result.microphone))


def microphone_words(place):
    if place is None:
        return "mean of all directions"
    distance_m, polar, azimuth = place
    return f"{100 * distance_m:.0f} cm, {math.degrees(polar):.0f} / {math.degrees(azimuth):.0f} degrees"


def show_bar(options):
    path = options.recordings and options.recordings / bar.RECORDING
    if not path or not path.exists():
        print(f"## The recorded bar\n\nskipped: {bar.RECORDING} is not in {options.recordings}; give the folder that "
              "has it\n")
        return
    whole = rings.read(path)
    recording = whole[:int(bar.SPAN_S * rings.RATE_HZ)]
    found = {hz: rings.ring_near(whole, hz) for hz in bar.HIGH_HZ}
    recorded = {hz: ring.decay_per_s for hz, ring in found.items() if ring}
    print("## The recorded bar\n")
    with programs.studio() as studio:
        answer = bar.first_fit(studio, path)
        print_table(fit_lines(answer))
        bench.print_head("", "MRSTFT", "octaves, dB", "decays, factor", *(f"{hz} Hz, 1/s" for hz in bar.HIGH_HZ),
                         "struck at, mm", "microphone")
        bench.print_row("recording", "", "", "", *(f"{recorded[hz]:.3g}" for hz in bar.HIGH_HZ), "", "")
        results = []
        for variant in bar.variants(studio, path, recording, answer):
            results.append(bar.measure(studio, recording, variant))
            print(result_line(results[-1], recorded), flush=True)
        print()
    draw([("recording", recording)] + [(result.name, result.sound) for result in results],
                  options.pictures / "bar.png", bar.SPAN_S)


def drop_line(heard, drop):
    summary = drop.summary
    return bench.row(drop.name, heard, f"{float(summary['peak']) * summary['full_scale_pa']:.2g}",
                         f"{drop.meter_db():.0f}",
                         *(f"{round(float(db))}" for db in drop.octaves_db()), f"{drop.ring_s():.2f}",
                         f"{summary['loudest_momentary_lufs']:.1f}" if "loudest_momentary_lufs" in summary else "-")


def show_drops(options):
    print("## Five drops\n")
    octaves = [f"{hz // 1000} kHz, dB" for hz in likeness.OCTAVES_HZ]
    bench.print_head("body", "sound", "peak, Pa", "dB(A), fast", *octaves, "40 dB down after, s", "loudest 0.4 s, LUFS")
    with programs.studio() as studio:
        pairs, energies = [], []
        for body in drops.BODIES:
            model = drops.decompose(studio, body)
            modes = drops.hear(studio, model, body, modes_only=True)
            whole = drops.hear(studio, model, body)
            pairs += [(f"{body.name}, modes only", modes.sound), (f"{body.name}, whole", whole.sound)]
            print(drop_line("modes only", modes), drop_line("whole", whole), sep="\n", flush=True)
            energies.append(bench.row(body.name, f"{1000 * whole.mass_kg:.0f}", f"{whole.first_j():.2g}",
                                          f"{whole.radiated_j():.2g}",
                                          f"{100 * whole.radiated_j() / whole.first_j():.2g}"))
            print(f"{body.name}: acceleration noise over modes, dB: {drops.click_db(modes.sound, whole.sound):+.1f}",
                  file=sys.stderr)
    print()
    print_table([*bench.head("body", "mass, g", "energy of the corner at the first contact, J", "radiated, J",
                                 "radiated, %"), *energies])
    draw(pairs, options.pictures / "drops.png", 1.0)


if __name__ == "__main__":
    parser = bench.parser(__doc__)
    parser.add_argument("--recordings", type=pathlib.Path)
    parser.add_argument("--parts", type=bench.names, default=["materials", "loudness", "bar", "drops"])
    parser.add_argument("--pictures", type=pathlib.Path)
    options = parser.parse_args()
    options.pictures = options.pictures or options.build / "truth"
    options.pictures.mkdir(parents=True, exist_ok=True)
    bench.use(options.build, "tests/benchmarks/decomposition")
    for part in options.parts:
        {"materials": show_materials, "loudness": show_loudness, "bar": show_bar, "drops": show_drops}[part](options)
