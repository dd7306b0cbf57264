# SPDX-License-Identifier: Apache-2.0
"""Stated errors of frequencies beside true ones, on nineteen bodies: six have re-entrant corners, and seven are
thin and flat."""

import math
import sys

import bench
import bodies
import measured
import numpy
import users
from scipy import optimize, spatial

FINER, MOST_NODES, MOST_SECONDS = 4, 300_000, 1200
NODES_PER_CORNER = 7
# Below a cent, which nobody hears, an error is not judged.
SMALLEST_ERROR = 5.8e-4
SAMPLES = 400
# Frequencies of one mode on two meshes differ by less than this, relatively, wherever an error is worth a look.
FURTHEST = 0.5
# Modes this close are a degenerate pair, whose shapes may turn into each other.
DEGENERATE = 2e-3
# Of a shape's squared norm, what the counterpart and its degenerate partner must have in common with it.
ALIKE = 0.8
GOALS = {"defaults": (), "3 %": ("--accuracy", "3%"), "1 %": ("--accuracy", "1%")}


def sampled(arrays, vertices):
    """The shapes at these vertices, of norm one: (3 times the vertices) by the modes."""
    shapes = arrays["shapes"][vertices].astype(float)
    shapes = shapes.reshape(-1, shapes.shape[-1])
    return shapes / numpy.linalg.norm(shapes, axis=0)


def pairs(ours, finer):
    """Indices of the modes of both models that are the same. A mode without a clear counterpart is in no pair."""
    chosen = numpy.random.default_rng(1).permutation(len(ours["vertices"]))[:SAMPLES]
    _, nearest = spatial.cKDTree(finer["vertices"]).query(ours["vertices"][chosen])
    alike = (sampled(ours, chosen).T @ sampled(finer, nearest))**2
    frequency, other = numpy.sqrt(ours["eigenvalues"]), numpy.sqrt(finer["eigenvalues"])
    alike[abs(numpy.log(frequency[:, None] / other[None, :])) > FURTHEST] = 0
    mine, theirs = optimize.linear_sum_assignment(alike, maximize=True)
    together = [alike[i, abs(other / other[j] - 1) < DEGENERATE].sum() for i, j in zip(mine, theirs)]
    clear = numpy.array(together) > ALIKE
    return mine[clear], theirs[clear]


def millimetres(*values):
    return [.001 * x for x in values]


def l_profile():
    return bodies.union(millimetres(0, 4, 30), millimetres(0, 4, 30), millimetres(0, 60, 120),
                        lambda i, j, k: i == 0 or j == 0)


def filleted_l_profile(length=.12, leg=.03, wall=.004, fillet=.002, steps=6):
    """Seen along its length; the origin lies within the corner, from which all of the outline is seen."""
    arc = [(wall + fillet * (1 - math.sin(a)), wall + fillet * (1 - math.cos(a)))
           for a in (math.pi / 2 * k / steps for k in range(steps + 1))]
    outline = [(0, 0), (leg, 0), (leg, wall), *arc, (wall, leg), (0, leg)]
    return users.prism([(x - wall / 2, y - wall / 2) for x, y in outline], length)


def fork():
    return bodies.union(millimetres(0, 4, 10, 14), millimetres(0, 30, 36, 120), millimetres(0, 4),
                        lambda i, j, k: i in (0, 2) and j == 2 or j == 1 or i == 1 and j == 0)


def stepped_shaft():
    profile = [(0, 0), (8, 0), (8, 40), (14, 40), (14, 60), (6, 60), (6, 110), (0, 110)]
    return bodies.lathe([(.001 * r, .001 * z) for r, z in profile], 24)


def frame():
    """A plate with a square hole."""
    return bodies.union(millimetres(0, 30, 60, 90), millimetres(0, 30, 60, 90), millimetres(0, 4),
                        lambda i, j, k: (i, j) != (1, 1))


def perforated_plate():
    """Square holes of 20 mm in cells of 30 mm."""
    xs, ys = ([*(.001 * (30 * i + x) for i in range(count) for x in (0, 5, 25)), .03 * count] for count in (6, 4))
    return bodies.union(xs, ys, millimetres(0, 2), lambda i, j, k: not i % 3 == j % 3 == 1)


def disc(inner, outer, thickness, around):
    return bodies.lathe([(inner, 0), (outer, 0), (outer, thickness), (inner, thickness)], around)


BODIES = [
    users.Body("bar", users.block(.2, .03, .02)),
    users.Body("plate", users.block(.3, .2, .003)),
    users.Body("bowl", lambda: bodies.bowl(.08, .003, 64, 24)),
    users.Body("bell", bodies.bell, "bell_bronze"),
    users.Body("chime", lambda: bodies.tube(.505, 24, 120), "chime_aluminum"),
    users.Body("bunny", lambda: bodies.bunny(.15, .15 / 28), "bunny_ceramic"),
    users.Body("L profile", l_profile),
    users.Body("L profile, fillet", filleted_l_profile),
    users.Body("fork", fork),
    users.Body("stepped shaft", stepped_shaft),
    users.Body("frame", frame),
    users.Body("gear", lambda: users.gear(teeth=12, inner=.03, outer=.04, height=.008)),
    users.Body("disc, 1 mm", lambda: disc(0, .08, .001, 64)),
    users.Body("disc, 2 mm", lambda: disc(0, .1, .002, 48)),
    users.Body("ring", lambda: disc(.05, .1, .002, 48)),
    users.Body("slat", users.block(.2, .02, .001)),
    users.Body("square plate", users.block(.1, .1, .001)),
    users.Body("perforated plate", perforated_plate),
    users.Body("triangular plate", lambda: users.prism([(.1, 0), (-.05, .08), (-.05, -.08)], .0015)),
]


class Solver:
    """Decompositions of one body, whose models stay in `folder`."""

    def __init__(self, body, surface, options, environment):
        self.body, self.surface, self.options, self.environment = body, surface, options, environment

    def run(self, name, *arguments):
        out = self.surface.with_suffix(f".{name}.model")
        run = measured.precompute(self.surface, ["--material", self.body.material, "--threads", "1", *arguments],
                                  self.options, self.environment, MOST_SECONDS, out)
        if run.verdict != "model":
            sys.exit(f"{self.body.name}, {name}: {run.report['error']['message']}")
        import scripted  # needs the paths of `use`
        return run.report, scripted.read_model(out)[1], run.cpu_seconds

    def finer(self, nodes):
        """A mesh of four times the nodes. Its band is stated, so that it has all modes whatever they cost."""
        return self.run("finer", "--nodes", str(min(FINER * nodes, MOST_NODES) // NODES_PER_CORNER),
                        "--band", "20:20000")


def errors(ours, finer):
    """Stated and true errors of the modes that both meshes have."""
    mine, theirs = pairs(ours[1], finer[1])
    stated = measured.column(ours[0], "estimated_error")[mine]
    true = measured.column(ours[0], "frequency_hz")[mine] / measured.column(finer[0], "frequency_hz")[theirs] - 1
    told = abs(true) > SMALLEST_ERROR
    return stated[told], abs(true[told])


def row(body, goal, ours, finer):
    stated, true = errors(ours, finer)
    report, _, cpu_seconds = ours
    found = [""] * 4
    if len(true):
        ratios = stated / true
        found = [f"{100 * stated.max():.2f} %", f"{100 * true.max():.2f} %",
                 f"{ratios.min():.2f}, {numpy.median(ratios):.2f}, {ratios.max():.2f}", numpy.sum(ratios >= 1)]
    bench.print_row(body.name, goal, report["nodes"], finer[0]["nodes"], f"{len(true)} of {len(report['modes'])}",
                    f"{cpu_seconds:.1f}", *found)
    return stated, true


def estimates(options, folder, environment):
    bench.use(options.build)
    bench.print_head("body", "goal", "nodes", "nodes of the finer mesh", "modes compared", "CPU s",
                     "largest stated error", "largest true error", "stated over true: least, median, most",
                     "modes within their bar")
    found = {goal: [] for goal in GOALS}
    for number, body in enumerate(BODIES):
        if options.only and body.name not in options.only:
            continue
        surface = folder / f"{number}.obj"
        bodies.write_obj(surface, *body.source())
        solver = Solver(body, surface, options, environment)
        runs = {goal: solver.run(str(n), *arguments) for n, (goal, arguments) in enumerate(GOALS.items())}
        finer = solver.finer(max(report["nodes"] for report, _, _ in runs.values()))
        for goal, ours in runs.items():
            found[goal].append(row(body, goal, ours, finer))
    for goal, rows in found.items():
        stated, true = (numpy.concatenate(values) for values in zip(*rows))
        every = stated / true
        print(f"\n{goal}: {100 * numpy.mean(every >= 1):.1f} % of {len(every)} modes are within their bar, which is "
              f"{numpy.median(every):.2f} times the true error in the median.")
