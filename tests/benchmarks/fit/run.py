#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How well `carillon material fit` finds materials: sounds of bodies whose material is known, a block whose
resonances are published, and sounds held against the mesh of another body.

    run.py --build BUILD [--rows hard60,hard40,...] [--draws 0,1,...] [--parts table,wrong,block]

Prints Markdown tables. A sound is the closed form of a struck body whose frequencies are jittered by 0.15 %, which
stands for what a mesh misses, decomposed at another Poisson's ratio than that of the model.
"""

import dataclasses
import json
import math
import os
import pathlib
import sys
import time

import numpy

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "decomposition")]
import bench  # noqa: E402
import struck  # noqa: E402

HARD_S, SOFT_S = (40e-6, 120e-6), (2e-4, 6e-4)
ROWS = {f"{name}{noise}{'room' * room}": (span, noise, room)
        for name, span in (("hard", HARD_S), ("soft", SOFT_S))
        for noise, room in ((60, False), (40, False), (20, False), (40, True))}
STRIKES, JITTER = 2, 0.0015
MOST_ERROR = 0.45  # relative, of decays that the fit takes for known
ROOM_T60_S, ROOM_LEVEL_DB = (0.25, 0.7), (-12, -6)

# Resonances that Ogi, Sato, Asada and Hirao measured on a block of an aluminium alloy (J. Acoust. Soc. Am. 112, 2553,
# 2002), kHz, and its constants.
OGI_SIZE_M, OGI_DENSITY, OGI_C11_PA, OGI_C44_PA = (0.01192, 0.01093, 0.00986), 2788, 109.26e9, 26.72e9
OGI_KHZ = (116.716, 143.783, 158.081, 166.5, 169.523, 177.846, 183.875, 186.047, 190.341, 197.386, 201.133, 207.386,
           209.836, 214.753, 223.548, 231.266, 233.538, 234.717, 250.98, 251.256, 252.742, 256.122, 257.595, 258.118,
           259.035, 268.54, 277.113, 278.762, 282.311, 293.686, 293.686, 293.686, 310.109, 316.197, 317.392, 326.462,
           329.034, 332.441, 333.364, 336.65, 337.359, 338.276)


@dataclasses.dataclass
class Outcome:
    """What one fit came to; only `refused` is set where there was no answer."""

    refused: str = ""
    young_error: float = 0.0  # relative, of E/rho
    nu_error: float = 0.0
    damping_error: float | None = 0.0  # median, relative, over the matched lines; None: no law was given
    matched: int = 0
    log_odds: float = 0.0
    cpu_s: float = 0.0
    # Deviations from the truth over two standard errors: of E/rho, of nu, of each decay, of each rate by the law.
    bars: tuple = ((),) * 4


class Studio:
    """A daemon with the models of the bodies, and files in its folder."""

    def __init__(self, build, daemon):
        self.build, self.daemon, self.folder = build, daemon, daemon.folder

    def decompose(self, name, surface, young, density, nu, *options):
        """The file with the model of a surface."""
        import meshes

        mesh, out = self.folder / f"{name}.obj", self.folder / f"{name}.model"
        if not out.exists():
            mesh.write_bytes(meshes.obj(*surface))
            bench.decompose(self.build, mesh, out, "--young", young, "--density", density, "--poisson", nu, *options)
        return out

    def known(self, body, material, nu):
        """The file with the model of a body of known material."""
        young, density, _ = struck.MATERIALS[material]
        return self.decompose(f"{body}-{material}-{nu:.4f}", struck.BODIES[body][0], young, density, nu, "--band",
                              "20:20000")

    def truth(self, body, material, nu):
        import scripted

        header, arrays = scripted.read_model(self.known(body, material, nu))
        return struck.Truth(body, material, nu, arrays["eigenvalues"], arrays["couplings"],
                            arrays["shapes"].astype(float), numpy.array(header.estimated_errors))

    def store(self, path):
        """The name of a model that the daemon stores."""
        return json.loads(self.daemon.command("--json", "model", "import", path).stdout)["name"]

    def model(self, body, material):
        return self.store(self.known(body, material, struck.NU_OF_MODELS))

    def fit(self, model, *arguments):
        """The JSON of a fit, or None and the refusal."""
        before = os.times()
        done = self.daemon.command("--json", "material", "fit", model.split("/")[-1], *arguments, check=False)
        after = os.times()
        cpu_s = after.children_user + after.children_system - before.children_user - before.children_system
        if done.returncode:
            return None, done.stderr.strip(), cpu_s
        return json.loads(done.stdout), "", cpu_s

    def strikes(self, name, truth, span, noise_db, room, random, keep=None):
        """Files with blows on a body."""
        import carillon

        hz = truth.frequencies_hz() * (1 + JITTER * random.standard_normal(len(truth.eigenvalues)))
        files = []
        for strike in range(STRIKES):
            sound = struck.strike(truth, hz, random.uniform(*span), noise_db, room, random, keep)
            files.append(self.folder / f"{name}-{strike}.wav")
            carillon.Sound(sound[:, None], struck.RATE_HZ).save(files[-1])
        return files


def law_decays(law, hz):
    omega = 2 * math.pi * hz
    eta = 0.0
    if law["loss_factor"]:
        points = numpy.log([(point["frequency_hz"], point["loss_factor"]) for point in law["loss_factor"]])
        eta = numpy.exp(numpy.interp(numpy.log(hz), points[:, 0], points[:, 1]))
    return (law["alpha1_s"] * omega**2 + law["alpha2_per_s"] + eta * omega) / 2


def judge(truth, answer, refusal, cpu_s):
    if answer is None:
        return Outcome(refused=refusal.split(":")[1].strip() if ":" in refusal else refusal, cpu_s=cpu_s)
    hz = numpy.array([line["frequency_hz"] for line in answer["lines"] if "mode" in line])
    damping = None
    if answer["laws"]:
        ratio = numpy.abs(numpy.log(law_decays(answer["laws"][0], hz) / truth.decays(hz)))
        damping = math.exp(float(numpy.median(ratio))) - 1
    young_error = answer["young_over_density"] / truth.young_over_density - 1
    nu_error = answer["poisson_ratio"] - truth.nu
    bars = ([young_error / answer["young_over_density_error"]], [nu_error / max(1e-9, answer["poisson_error"])],
            *(deviations(truth, answer, name) for name in ("decay", "law")))
    return Outcome(young_error=young_error, nu_error=nu_error, damping_error=damping, matched=answer["matched"],
                   log_odds=answer["log_odds"], cpu_s=cpu_s, bars=tuple(numpy.abs(bar) / 2 for bar in bars))


def deviations(truth, answer, name):
    """Those of the rates of matched lines, "decay" or "law", over their standard errors, as far as they are stated to
    be known."""
    lines = [(line[f"{name}_per_s"], line[f"{name}_error_per_s"], line["frequency_hz"]) for line in answer["lines"]
             if "mode" in line]
    return numpy.array([(rate - float(truth.decays(hz))) / error for rate, error, hz in lines
                        if 0 < error < MOST_ERROR * rate])


def cases():
    """Yields (number, body, material, Poisson's ratio)."""
    number = 0
    for body, (_, materials) in struck.BODIES.items():
        for material in materials:
            number += 1
            yield number, body, material, round(float(numpy.random.default_rng(99 + number).uniform(0.18, 0.38)), 3)


def run_row(studio, row, draw):
    span, noise_db, room = ROWS[row]
    outcomes = []
    for number, body, material, nu in cases():
        truth = studio.truth(body, material, nu)
        random = numpy.random.default_rng(100000 * room + 1000 * number + list(ROWS).index(row) + 10**6 * draw)
        drawn = (random.uniform(*ROOM_T60_S), random.uniform(*ROOM_LEVEL_DB)) if room else None
        files = studio.strikes(row, truth, span, noise_db, drawn, random)
        outcomes.append(judge(truth, *studio.fit(studio.model(body, material), *files, "--density", truth.density)))
    return outcomes


def run_lines(studio):
    """A plate with modes missing and false ones in their place: 4 missing, 4 + 4 false, 7 + 7 false."""
    truth = studio.truth("plate", "aluminium", 0.33)
    model = studio.model("plate", "aluminium")
    outcomes = []
    for missing, false in ((4, 0), (4, 4), (7, 7)):
        for draw in range(8):
            random = numpy.random.default_rng(100 * missing + 10 * false + draw)
            hz = truth.frequencies_hz()[:14] * (1 + JITTER * random.standard_normal(14))
            kept = random.permutation(14)[missing:]
            lines = [*hz[kept], *numpy.exp(random.uniform(math.log(hz[0]), math.log(hz[-1]), false))]
            table = studio.folder / "lines.csv"
            table.write_text("frequency_hz\n" + "\n".join(f"{line:.3f}" for line in lines) + "\n")
            outcomes.append(judge(truth, *studio.fit(model, "--modes", table, "--density", truth.density)))
    return outcomes


def run_wrong(studio):
    """Each body's sound against the models of the others."""
    outcomes = []
    for number, body, material, nu in cases():
        truth = studio.truth(body, material, nu)
        random = numpy.random.default_rng(7000 + number)
        files = studio.strikes("wrong", truth, HARD_S, 40, None, random)
        others = [other for other in struck.BODIES if other != body]
        for other in (others[number % 4], others[(number + 1) % 4]):
            model = studio.model(other, struck.BODIES[other][1][0])
            outcomes.append(judge(truth, *studio.fit(model, *files, "--density", truth.density)))
    return outcomes


def print_row(name, outcomes, damping=True):
    answers = [outcome for outcome in outcomes if not outcome.refused]
    lawful = [outcome for outcome in answers if outcome.damping_error is not None]
    many = [outcome for outcome in answers if outcome.matched >= 6]

    def count(among, test):
        return f"{sum(map(test, among))} of {len(among)}"

    def median(values):
        values = list(values)
        return float(numpy.median(values)) if values else math.nan

    laws, off = "-", "-"
    if damping:
        laws = f"{count(lawful, lambda o: o.damping_error < 0.1)}, {len(answers) - len(lawful)} without"
        off = f"{100 * median(o.damping_error for o in lawful):.1f} %"
    bench.print_row(
        name, len(outcomes), len(outcomes) - len(answers), count(many, lambda o: abs(o.young_error) < 0.005),
        count(many, lambda o: abs(o.nu_error) < 0.02), laws, count(answers, lambda o: abs(o.young_error) < 0.01),
        f"{100 * median(abs(o.young_error) for o in answers):.2f} %, {median(abs(o.nu_error) for o in answers):.4f}, "
        f"{off}, {median(o.matched for o in answers):.0f}", f"{median(o.cpu_s for o in outcomes):.1f}")


def print_bars(rows):
    """How many truths lie within two stated standard errors."""
    print()
    bench.print_head("strikes", "E/rho", "nu", "decays", "rates by the law", "of them in laws over 10 % off")

    def count(outcomes, bar):
        ratios = numpy.concatenate([outcome.bars[bar] for outcome in outcomes] or [[]])
        return f"{numpy.sum(ratios < 1)} of {len(ratios)}"

    for name, outcomes in (*rows.items(), ("all", sum(rows.values(), []))):
        off = [outcome for outcome in outcomes if (outcome.damping_error or 0) > 0.1]
        bench.print_row(name, *(count(outcomes, bar) for bar in range(4)), count(off, 3))


def show_table(studio, rows, draws):
    bench.print_head("strikes", "cases", "refused", "E/rho < 0.5 % (six lines)", "nu < 0.02 (six lines)",
                     "damping < 10 %", "E/rho < 1 %", "median E/rho, nu, damping, lines", "CPU s")
    outcomes = {}
    for row in rows:
        outcomes[row] = [outcome for draw in draws for outcome in run_row(studio, row, draw)]
        print_row(row, outcomes[row])
    print_row("lines missing and false", run_lines(studio), damping=False)
    print_bars(outcomes)


def show_wrong(studio):
    outcomes = run_wrong(studio)
    refused = [outcome.refused for outcome in outcomes if outcome.refused]
    reasons = ", ".join(f"{refused.count(reason)} {reason}" for reason in sorted(set(refused)))
    print(f"\nAgainst the mesh of another body {len(refused)} of {len(outcomes)} were refused: {reasons}.")


def show_block(studio):
    """Ogi's block, of which frequencies alone are known."""
    name = studio.store(studio.decompose("block", struck.box(*OGI_SIZE_M), 70e9, OGI_DENSITY, 0.33, "--band",
                                         "20:350000", "--accuracy", "0.1%"))
    table = studio.folder / "block.csv"
    lame = OGI_C11_PA - 2 * OGI_C44_PA
    young, nu = OGI_C44_PA * (3 * lame + 2 * OGI_C44_PA) / (lame + OGI_C44_PA), lame / (2 * (lame + OGI_C44_PA))
    for count, known in ((len(OGI_KHZ), ()), (12, ()), (12, ("--young-range", "69e9:75e9"))):
        table.write_text("frequency_hz\n" + "".join(f"{1000 * khz:.0f}\n" for khz in OGI_KHZ[:count]))
        answer, refusal, _ = studio.fit(name, "--modes", table, "--density", OGI_DENSITY, *known)
        print(f"\nOgi's block by {count} lines{' ' if known else ''}{' '.join(known)}: ", end="")
        print(refusal if answer is None else
              f"E {100 * (answer['young_pa'] / young - 1):+.2f} %, nu {answer['poisson_ratio'] - nu:+.4f}, "
              f"{answer['matched']} matched, {100 * answer['rms']:.2f} % apart, log odds {answer['log_odds']:.1f}.")


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--rows", default=",".join(ROWS))
    parser.add_argument("--draws", default="0", help="numbers, each of which draws other strikes and rooms")
    parser.add_argument("--parts", default="table,wrong,block")
    options = parser.parse_args()
    bench.use(options.build)
    started = time.monotonic()
    with bench.daemon() as daemon:
        studio = Studio(options.build, daemon)
        if "table" in options.parts:
            show_table(studio, options.rows.split(","), [int(draw) for draw in options.draws.split(",")])
        if "wrong" in options.parts:
            show_wrong(studio)
        if "block" in options.parts:
            show_block(studio)
    print(f"\n{time.monotonic() - started:.0f} s.")


if __name__ == "__main__":
    main()
