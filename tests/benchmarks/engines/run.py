#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""One fall in five engines, or ten, at three rates of steps: how loud it comes out, as a table.

Each number is a level relative to the median of all engines and rates of its scene: of a fall and of a collision the
energy of the first blow, of a roll and of a slide the mean power. Beside it stand, where they belong: the greatest
sample at rest relative to the greatest of all, and how far lines at the step rate stand out of a roll or a slide.
"""

import json
import pathlib
import statistics
import subprocess
import sys

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import bench  # noqa: E402

RATES_HZ = (60, 240, 1000)
SAMPLE_RATE_HZ = 48000
# Scene: simulated seconds, and the window of what travels.
SECONDS = {"flat": 2.0, "tilted": 2.0, "corner": 3.0, "collision": 1.0, "roll": 1.2, "slide": 2.0}
TRAVELS_S = {"roll": (0.2, 1.1), "slide": (0.15, 0.85)}
BLOW_S = 0.06
GAIN = 0.001  # no limiter shall make levels alike
LIMITS_DB = {"flat": 3, "tilted": 3, "corner": 3, "collision": 3, "roll": 4, "slide": 4}
REST_DB, LINES_DB = -100, 3
# The box of tests/client_sdk/adapters/drops.js, which falls in further engines for JavaScript, too.
DROPS = {"flat": (1, 0, 0, 0), "tilted": (0.84419, 0.3485584, -0.4056972, -0.03549596)}
DROP_ENGINES = {"rapier": "rapier", "havok": "havok", "cannon-es": "cannon", "Jolt": "jolt", "mujoco-js": "mujoco",
                "PhysX": "physx", "DART": "dart"}


def decibels(ratio):
    return 10 * numpy.log10(ratio + 1e-30)


def between(samples, begin_s, end_s):
    return samples[int(begin_s * SAMPLE_RATE_HZ):int(end_s * SAMPLE_RATE_HZ)]


def blow_energy(samples):
    """Of the first blow: from where the sound begins on, for so long that no engine's second one is in it."""
    begin = int(numpy.argmax(numpy.abs(samples) > 0.01 * numpy.abs(samples).max()))
    return numpy.sum(numpy.square(samples[begin:begin + int(BLOW_S * SAMPLE_RATE_HZ)])) / SAMPLE_RATE_HZ


def measure(name, samples, rate_hz):
    """The level in decibels, and what stands beside it."""
    if name in TRAVELS_S:
        import sound
        travels = between(samples, *TRAVELS_S[name])
        return {"level_db": decibels(numpy.mean(numpy.square(travels))), "lines_db": sound.lines_db(travels, rate_hz)}
    measured = {"level_db": decibels(blow_energy(samples))}
    if name == "corner" or name in DROPS:
        rest = numpy.abs(between(samples, SECONDS[name] - 0.4, SECONDS[name])).max()
        measured["rest_db"] = 2 * decibels(rest / numpy.abs(samples).max())
    return measured


def is_right(name, measured):
    return (abs(measured["relative_db"]) <= LIMITS_DB[name] and measured.get("rest_db", REST_DB) <= REST_DB
            and measured.get("lines_db", 0) < LINES_DB)


def cell(name, measured):
    text = f"{measured['relative_db']:+.1f}"
    if "rest_db" in measured:
        text += f" (rest {measured['rest_db']:.0f})"
    if "lines_db" in measured:
        text += f" (lines {measured['lines_db']:+.1f})"
    return text if is_right(name, measured) else f"**{text}**"


def drop_scene(name):
    sides, mass = (0.2, 0.14, 0.06), 1.21
    import falls
    return {"friction": 0.5, "restitution": 0, "bodies": [
        {"name": "floor", "shape": {"plane": {}}},
        {"name": "box", "shape": {"boxes": [{"sides_m": sides}]}, "mass_kg": mass,
         "inertia_kg_m2": falls.box_inertia(mass, sides), "position_m": (0, 0, 0.3), "velocity_m_per_s": (0.5, 0, 0),
         "orientation": DROPS[name], "material": "concrete", "wall_m": 0.006, "max_frequency_hz": 8000}]}


def scene_of(name):
    import falls
    return drop_scene(name) if name in DROPS else json.loads((falls.SCENES / f"{name}.json").read_text())


def engines_of(name):
    import falls
    return dict.fromkeys((*falls.ENGINES, *DROP_ENGINES)) if name in DROPS else falls.ENGINES


def record(name, engine, scene, trace, rate, build):
    import falls
    if name not in DROPS or engine in falls.ENGINES and engine not in falls.IN_NODE:
        return falls.record(engine, scene, trace, rate=rate, seconds=SECONDS[name], build=build)
    if engine == "DART":
        return drop_in_dart(scene["bodies"][1]["model"], trace, rate, name)
    return subprocess.run(["node", pathlib.Path(__file__).with_name("drop.js"), DROP_ENGINES[engine],
                           *map(str, (rate, SECONDS[name], scene["bodies"][1]["model"], trace, *DROPS[name]))],
                          check=True, env=falls.node_environment(trace.parent))


def drop_in_dart(model, path, rate, name):
    import carillon
    from dart_drop import HEIGHT_M, DartDrop
    drop = DartDrop(1 / rate, DROPS[name])
    trace = carillon.Trace(1 / rate, frame="scene", simulator="DART")
    trace.add(model, handle=1, pose=((0, 0, HEIGHT_M), DROPS[name]))
    for step in range(1, round(SECONDS[name] * rate) + 1):
        trace.step(step / rate, **drop.step())
    trace.write(path)


def render(client, path):
    """Softly, so that nothing is limited."""
    import carillon
    trace = carillon.Trace.read(path)
    for body in trace.objects:
        body.gain = GAIN
    sound = client.render(trace, sample_rate_hz=SAMPLE_RATE_HZ, tail_s=1)
    assert sound.summary.limited_frame_count == 0, path
    return sound


def print_table(name, table):
    level = statistics.median(one["level_db"] for one in table.values())
    for measured in table.values():
        measured["relative_db"] = measured["level_db"] - level
    print(f"\n{name}: dB of the median; bold is beyond {LIMITS_DB[name]} dB, rests above {REST_DB} dB, or has lines\n")
    engines = dict.fromkeys(engine for engine, _ in table)
    rates = dict.fromkeys(rate for _, rate in table)
    bench.print_head("engine", *(f"{rate} Hz" for rate in rates))
    for engine in engines:
        bench.print_row(engine, *(cell(name, table[engine, rate]) for rate in rates))
    return sum(not is_right(name, measured) for measured in table.values())


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--scenes", nargs="*", default=list(SECONDS), choices=list(SECONDS))
    parser.add_argument("--engines", nargs="*", help="all unless named")
    parser.add_argument("--rates", nargs="*", type=int, default=RATES_HZ)
    parser.add_argument("--keep", type=pathlib.Path, help="a folder that keeps traces and sounds")
    options = parser.parse_args()
    bench.use(options.build, "client_sdk/examples/falls", "tests/client_sdk/adapters")
    # They need the paths of `use`.
    import carillon
    import falls
    wrong = 0
    with bench.daemon() as daemon, carillon.connect(daemon.server) as client:
        folder = options.keep or daemon.folder
        folder.mkdir(parents=True, exist_ok=True)
        for scene_name in options.scenes:
            scene = falls.create_models(client, scene_of(scene_name))
            table = {}
            for engine in options.engines or engines_of(scene_name):
                for rate in options.rates:
                    trace = folder / f"{scene_name}-{engine}-{rate}.contacts"
                    record(scene_name, engine, scene, trace, rate, options.build)
                    sound = render(client, trace)
                    if options.keep:
                        sound.save(trace.with_suffix(".wav"))
                    table[engine, rate] = measure(scene_name, sound.mono, rate)
            wrong += print_table(scene_name, table)
    print(f"\n{wrong} numbers are beyond the limits")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
