# SPDX-License-Identifier: Apache-2.0
"""The material catalogue, read from proto/materials.textproto."""

import dataclasses
import math
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[3]
CATALOGUE = ROOT / "proto/materials.textproto"


@dataclasses.dataclass
class Material:
    name: str
    young_pa: float
    poisson_ratio: float
    density_kg_per_m3: float
    alpha1_s: float
    alpha2_per_s: float
    loss_factor: list  # of (Hz, eta), ascending
    source: str

    def loss_factor_at(self, hz):
        """As LossFactorAt of proto/cpp: linear in the logarithms, constant beyond the ends."""
        points = self.loss_factor
        if not points:
            return 0.0
        if hz <= points[0][0]:
            return points[0][1]
        for (low, eta_low), (high, eta_high) in zip(points, points[1:]):
            if hz <= high:
                part = math.log(hz / low) / math.log(high / low)
                return eta_low * (eta_high / eta_low)**part
        return points[-1][1]

    def decay_per_s(self, hz):
        omega = 2 * math.pi * hz
        return (self.alpha1_s * omega**2 + self.alpha2_per_s + self.loss_factor_at(hz) * omega) / 2


def read(path=CATALOGUE):
    """The materials by name, in the order of the file."""
    found = {}
    for block in re.split(r"^materials \{$", path.read_text(), flags=re.M)[1:]:
        figures = {name: float(value) for name, value in re.findall(r"^    (\w+): (\S+)$", block, re.M)}
        points = re.findall(r"frequency_hz: (\S+)\s+loss_factor: (\S+)", block)
        name, source = (re.search(rf'^  {key}: "(.*)"$', block, re.M)[1] for key in ("name", "source"))
        found[name] = Material(name=name, source=source.replace('\\"', '"'), **figures,
                               loss_factor=[(float(hz), float(eta)) for hz, eta in points])
    return found
