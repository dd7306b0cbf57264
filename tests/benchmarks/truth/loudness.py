# SPDX-License-Identifier: Apache-2.0
"""How loud each mode truly is beside the paper's coupling, for six bodies."""

import dataclasses
import math
import statistics

import bench

# What the mixer makes of a unit of the paper's coupling: the density of air times 2 pi 1 kHz over 4 pi, Pa at 1 m.
COUPLING_TO_PA = 1.204 * 2 * math.pi * 1000 / (4 * math.pi)


@dataclasses.dataclass
class Difference:
    """The pressure of each mode by its radiation over that by the paper's coupling, dB."""

    hz: list
    db: list

    def line(self):
        high = [x for hz, x in zip(self.hz, self.db) if hz > 5 * self.hz[0]] or self.db
        return [len(self.hz), f"{self.db[0]:+.1f} at {self.hz[0]:.0f} Hz", f"{statistics.median(self.db):+.1f}",
                f"{statistics.median(high):+.1f}", f"{max(self.db) - min(self.db):.0f}"]


HEAD = ("body", "material", "modes", "lowest mode, dB", "median, dB", "median above 5 times the lowest, dB",
        "spread, dB")


def six_bodies():
    """(name, surface, material) of each."""
    import bodies
    import drops

    return (("chime, 403 mm", bodies.tube(0.403, 24, 96), "chime_aluminum"),
            ("bowl, 160 x 3 mm", bodies.bowl(0.08, 0.003, 64, 24), "porcelain"),
            ("bell, 100 mm", bodies.bell(), "bell_bronze"),
            ("hollow bunny, 150 mm", bodies.bunny(0.15, 0.15 / 28, 0.004), "porcelain"),
            ("tumbler", drops.tumbler(), "soda_lime_glass"),
            ("plate, 300 x 200 x 3 mm", bodies.box((0.3, 0.2, 0.003), (1, 1, 1)), "structural_steel"))


def measure(build, folder, surface, material):
    """The Difference of a body's modes, those that were computed."""
    import bodies

    mesh = folder / "body.obj"
    bodies.write_obj(mesh, *surface)
    report = bench.decompose(build, mesh, folder / "body.model", "--material", material, "--transfer")
    modes = [mode for mode in report["modes"] if mode["radiation"]["computed"]]
    return Difference([mode["frequency_hz"] for mode in modes],
                      [20 * math.log10(mode["radiation"]["pressure_at_1m_pa"] / (COUPLING_TO_PA * mode["coupling"]))
                       for mode in modes])
