# SPDX-License-Identifier: Apache-2.0
"""Five bodies dropped on a hard floor."""

import dataclasses
import math
import random

import numpy

import catalogue
import likeness
import programs
import rings

HEIGHT_M, GRAVITY_M_PER_S2 = 0.3, 9.81
BOUNCE_COUNT, RESTITUTION = 6, 0.5
FIRST_S = 0.1  # the first contact begins before its middle, so not at the start of the rendering
# The floor, of concrete, does not move: the body's corner meets it with the mass that it has there, a third of the
# body's.
FLOOR = {"striker_young_pa": 30e9, "striker_poisson_ratio": 0.2}
PASCALS_SQUARED_TO_WATTS = 4 * math.pi / (1.204 * 343)  # of the mean over all directions, 1 m away


@dataclasses.dataclass
class Body:
    name: str
    surface: callable  # (vertices, triangles)
    material: str
    volume_m3: float
    wall_m: float = None  # hollow


@dataclasses.dataclass
class Drop:
    """What was heard of a body."""

    name: str
    sound: object
    summary: dict
    mass_kg: float

    def pascals(self):
        return float(self.summary["full_scale_pa"]) * self.sound

    def first_j(self):
        """The energy with which the corner meets the floor first."""
        return self.mass_kg / 3 * GRAVITY_M_PER_S2 * HEIGHT_M

    def radiated_j(self):
        """What the first contact sends into the air until the second."""
        second_s = FIRST_S + 2 * RESTITUTION * math.sqrt(2 * HEIGHT_M / GRAVITY_M_PER_S2)
        first = self.pascals()[:int(second_s * rings.RATE_HZ)]
        return PASCALS_SQUARED_TO_WATTS * float((first**2).sum()) / rings.RATE_HZ

    def meter_db(self):
        """What a sound level meter shows at most: dB(A), fast."""
        return likeness.fast_level_db(self.pascals(), rings.RATE_HZ)

    def octaves_db(self):
        return likeness.octave_levels_db(self.sound, rings.RATE_HZ)

    def ring_s(self):
        """Time from the loudest millisecond until the sound stays 40 dB below it."""
        count = len(self.sound) // 48
        level = (self.sound[:48 * count].reshape(count, 48)**2).mean(axis=1)
        audible = (level > 1e-4 * level.max()).nonzero()[0]
        return float(audible[-1] - level.argmax()) / 1000


def tumbler():
    """A drinking glass, 70 mm wide and 100 mm high, its wall 2 mm and its bottom 5 mm."""
    import bodies

    rim = numpy.linspace(0, 0.1, 17)
    outer = [(r, 0) for r in numpy.linspace(0, 0.035, 6)] + [(0.035, z) for z in rim[1:]]
    inner = [(0.033, z) for z in numpy.linspace(0.1, 0.005, 16)]
    return bodies.lathe(outer + inner + [(r, 0.005) for r in numpy.linspace(0.033, 0, 6)[1:]], 48)


def box(*size_m):
    import bodies

    return bodies.box(size_m, (1, 1, 1))


def bowl():
    import bodies

    return bodies.bowl(0.08, 0.004, 48, 12)


def hollow(wall_m, *size_m):
    return math.prod(size_m) - math.prod(side - 2 * wall_m for side in size_m)


BODIES = (Body("steel box", lambda: box(0.10, 0.07, 0.05), "structural_steel", hollow(0.0015, 0.10, 0.07, 0.05),
               wall_m=0.0015),
          Body("wooden block", lambda: box(0.12, 0.06, 0.04), "oak", 0.12 * 0.06 * 0.04),
          Body("ceramic bowl", bowl, "porcelain", 2 * math.pi * 0.078**2 * 0.004),
          Body("glass", tumbler, "soda_lime_glass", math.pi * (0.035**2 * 0.1 - 0.033**2 * 0.095)),
          Body("plastic box", lambda: box(0.10, 0.07, 0.03), "abs", hollow(0.0025, 0.10, 0.07, 0.03), wall_m=0.0025))


def blows(surface, mass_kg):
    """The bounces: each meets the floor with another vertex, the same in each run, and a third of the mass."""
    vertices = [tuple(map(float, vertex)) for vertex in surface[0]]
    centre = [(min(side) + max(side)) / 2 for side in zip(*vertices)]
    found, time_s, speed = [], FIRST_S, math.sqrt(2 * GRAVITY_M_PER_S2 * HEIGHT_M)
    for point in random.Random(1).choices(vertices, k=BOUNCE_COUNT):
        impulse = mass_kg / 3 * speed * (1 + RESTITUTION)
        inwards = [c - x for x, c in zip(point, centre)]
        collision = {**FLOOR, "reduced_mass_kg": mass_kg / 3, "approach_speed_m_per_s": speed}
        found.append(programs.Blow(point, tuple(impulse * x / math.hypot(*inwards) for x in inwards),
                                   time_s=time_s, collision=collision))
        speed *= RESTITUTION
        time_s += 2 * speed / GRAVITY_M_PER_S2
    return found


def decompose(studio, body):
    """The name of the body's stored model."""
    import bodies

    mesh, out = (studio.folder / f"{body.name}.{suffix}" for suffix in ("obj", "model"))
    bodies.write_obj(mesh, *body.surface())
    wall = ["--wall", body.wall_m] if body.wall_m else []
    studio.decompose(mesh, out, "--material", body.material, *wall)
    return studio.import_model(out)


def click_db(modes, whole):
    """Energy of the acceleration noise over that of the modes, dB."""
    count = min(len(modes), len(whole))
    click = numpy.array(whole, dtype=float)
    click[:count] -= modes[:count]
    return 10 * math.log10((click**2).sum() / max((numpy.asarray(modes, dtype=float)**2).sum(), 1e-30))


def hear(studio, model, body, modes_only=False):
    """The Drop, which may be left without the sound of the body's acceleration."""
    material = catalogue.read()[body.material]
    figures = {"young_pa": material.young_pa, "density_kg_per_m3": material.density_kg_per_m3,
               **programs.loss_factor(material.loss_factor)}
    studio.radiate(model, figures)
    heard = programs.Heard(model, figures, paper_coupling=False, gaussian=False, modes_only=modes_only)
    mass_kg = body.volume_m3 * material.density_kg_per_m3
    sound, summary = studio.render(heard, blows(body.surface(), mass_kg), 0)
    return Drop(body.name, sound, summary, mass_kg)
