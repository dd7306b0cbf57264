#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the tables of docs/materials.md: the catalogue, and its decays beside those of recorded bodies.

    materials.py [--write]    # --write puts them into the page, between its marker comments
"""

import math
import pathlib
import statistics
import sys

import catalogue

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from bench import head, row  # noqa: E402

PAGE = catalogue.ROOT / "docs/materials.md"
BEGIN, END = "<!-- {}: tests/benchmarks/truth/materials.py --write prints it. -->", "<!-- The end of {}. -->"

# The steel bar of the recordings: Hz, family, decay rate 1/s with the standard error of its fit (rings.py), and the
# part of it that is radiated, by boundary elements to 0.3 dB.
BAR = [(6880, "bending", 18.9, 0.3, 10.7), (7020, "torsion", 1.86, 0.03, 1.03), (10947, "torsion", 12.0, 0.1, 11.6),
       (11306, "bending", 20.5, 0.2, 19.5), (15350, "torsion", 23.6, 0.1, 19.2), (16719, "bending", 22.1, 0.9, 16.9)]
BAR_MATERIAL = "structural_steel"
# Bodies of RealImpact: their measured loss factor, strong modes of 8 to 13 kHz, and the material that is nearest.
BODIES = [("glass cup", 0.0015, "soda_lime_glass"), ("ceramic koi bowl", 0.0017, "stoneware"),
          ("ceramic swan", 0.0014, "stoneware"), ("ceramic pitcher", 0.0042, "earthenware"),
          ("iron skillet", 0.0013, "cast_iron"), ("steel stand", 0.0029, "structural_steel"),
          ("plastic scoop", 0.0096, "abs"), ("wooden pad", 0.0104, "oak")]
BODIES_HZ = 10000


def factor(ratio):
    """By how much a figure is missed, in either direction."""
    return max(ratio, 1 / ratio)


def damping(material):
    if not material.loss_factor:
        return f"alpha1 {material.alpha1_s:g} s, alpha2 {material.alpha2_per_s:g} 1/s"
    if len(material.loss_factor) == 1:
        return f"{material.loss_factor[0][1]:g}"
    return ", ".join(f"{eta:g} at {hz:g} Hz" for hz, eta in material.loss_factor)


def catalogue_table(materials):
    """Name, figures, damping, and the time in which a mode of 1 kHz decays by 60 dB by the material alone."""
    yield from head("material", "E, GPa", "nu", "density, kg/m3", "loss factor", "T60 at 1 kHz, s")
    for m in materials.values():
        t60_s = math.log(1000) / m.decay_per_s(1000)
        yield row(m.name, f"{m.young_pa / 1e9:.4g}", f"{m.poisson_ratio:.3g}", f"{m.density_kg_per_m3:g}",
                  damping(m), f"{t60_s:.2g}")


def bar_table(materials):
    yield from head("mode, Hz", "recorded, 1/s", "material", "radiation", "sum", "sum / recorded")
    missed = []
    for hz, family, recorded, error, radiated in BAR:
        material = materials[BAR_MATERIAL].decay_per_s(hz)
        missed.append(factor((material + radiated) / recorded))
        yield row(f"{hz} {family}", f"{recorded} ± {error}", f"{material:.2f}", radiated, f"{material + radiated:.1f}",
                  f"{(material + radiated) / recorded:.2f}")
    yield row("median factor by which it is missed", "", "", "", f"{statistics.median(missed):.2f}", "")


def body_table(materials):
    yield from head("body", "recorded loss factor, with radiation", "catalogue", "its loss factor", "over the recorded")
    missed = []
    for body, recorded, name in BODIES:
        found = materials[name].loss_factor_at(BODIES_HZ)
        missed.append(factor(found / recorded))
        yield row(body, f"{recorded:g}", name, f"{found:.2g}", f"{found / recorded:.2f}")
    yield row("median factor by which it is missed", "", "", f"{statistics.median(missed):.2f}", "")


def tables():
    materials = catalogue.read()
    return {"The catalogue": catalogue_table(materials), "The decays of the bar": bar_table(materials),
            "The losses of bodies": body_table(materials)}


def page_with_tables(text):
    """The text of the page with each table between its markers."""
    for title, lines in tables().items():
        begin, end = BEGIN.format(title), END.format(title)
        before, rest = text.split(begin, 1)
        text = before + begin + "\n" + "\n".join(lines) + "\n" + end + rest.split(end, 1)[1]
    return text


if __name__ == "__main__":
    if "--write" in sys.argv[1:]:
        PAGE.write_text(page_with_tables(PAGE.read_text()))
    else:
        for title, lines in tables().items():
            print(f"{title}\n", *lines, sep="\n", end="\n\n")
