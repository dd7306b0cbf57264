# SPDX-License-Identifier: AGPL-3.0-or-later
"""Ill-made surfaces, and models as artists make them, without and with --repair: a table of verdicts."""

import argparse
import pathlib
import sys

PRECOMPUTE_TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(PRECOMPUTE_TESTS))

import ill_made_surfaces  # noqa: E402
import surfaces  # noqa: E402

# Where Debian's packages have models; those that are not installed are left out.
ARTISTS_MODELS = ["/usr/share/glmark2/models/bunny.obj", "/usr/share/glmark2/models/*.3ds"]


def show(verdict):
    if verdict.outcome == "model":
        return f"{verdict.first_hz:8.1f} Hz {verdict.seconds:6.1f} s"
    return verdict.outcome


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, type=pathlib.Path)
    program = parser.parse_args().build / "bin/carillon-precompute"
    sound_hz = surfaces.sound_bodies_hz(program)
    print("sound bodies:", ", ".join(f"{name} {hz:.1f} Hz" for name, hz in sound_hz.items()))
    print(f"{'surface':36} {'as given':24} {'--repair':24} faults")
    faults = 0
    for case in ill_made_surfaces.cases():
        plain, repaired = (surfaces.decompose(program, case.content, case.form, case.options + more)
                           for more in ([], ["--repair"]))
        wrong = [fault for fault in (surfaces.fault(case.plain, plain, sound_hz),
                                     surfaces.fault(case.repaired, repaired, sound_hz)) if fault]
        faults += len(wrong)
        print(f"{case.name:36} {show(plain):24} {show(repaired):24} {'; '.join(wrong)}", flush=True)
    for pattern in ARTISTS_MODELS:
        for path in sorted(pathlib.Path("/").glob(pattern[1:])):
            if path.suffix not in (".obj", ".ply", ".stl", ".off"):
                continue
            plain, repaired = (surfaces.decompose(program, path.read_bytes(), path.suffix[1:],
                                                  ["--unit", "0.1", *more])
                               for more in ([], ["--repair"]))
            bad = [v.outcome for v in (plain, repaired) if v.outcome.startswith(("crash", "hang"))]
            faults += len(bad)
            print(f"{path.name:36} {show(plain):24} {show(repaired):24} {'; '.join(bad)}", flush=True)
    print(f"{faults} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
