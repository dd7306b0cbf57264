# SPDX-License-Identifier: Apache-2.0
"""Bodies of known material, and the sounds that a hammer would draw from them."""

import dataclasses
import math

import bodies
import numpy

RATE_HZ = 48000
AROUND = 48  # corners of each circle of a turned body
SECONDS = 1.5
NU_OF_MODELS = 0.28
# E in Pa, density, and the law of damping: "eta" and a loss factor, "rayleigh" and alpha1, alpha2, "table".
MATERIALS = {
    "steel": (205e9, 7850, ("eta", 4e-4)),
    "glass": (70e9, 2500, ("table", ((300, 6e-4), (3000, 1.2e-3), (15000, 2.5e-3)))),
    "bronze": (105e9, 8600, ("rayleigh", (2e-8, 1.5))),
    "aluminium": (69e9, 2700, ("eta", 7e-4)),
    "ABS": (2.3e9, 1050, ("table", ((200, 1.2e-2), (2000, 1.6e-2), (10000, 2.2e-2)))),
}


def extruded(polygon, height):
    """(vertices, faces) of a polygon (counter-clockwise, of which the first corner sees all others)."""
    count = len(polygon)
    vertices = [(x, y, z) for z in (0.0, height) for x, y in polygon]
    faces = [(0, i + 1, i) for i in range(1, count - 1)]
    faces += [(count, count + i, count + i + 1) for i in range(1, count - 1)]
    for i in range(count):
        j = (i + 1) % count
        faces += [(i, j, count + j), (i, count + j, count + i)]
    return vertices, faces


def box(x, y, z):
    return extruded([(0, 0), (x, 0), (x, y), (0, y)], z)


def cup(radius=0.04, height=0.09, wall=0.003, steps=12):
    inner = radius - wall
    outside = [(radius, height * k / steps) for k in range(steps + 1)]
    inside = [(inner, wall + (height - wall) * k / steps) for k in range(steps, -1, -1)]
    return bodies.lathe([(0, 0), (radius / 2, 0), *outside, *inside, (inner / 2, wall), (0, wall)], AROUND)


BODIES = {
    "bar": (box(0.12, 0.026, 0.005), ("steel", "ABS")),
    "plate": (box(0.14, 0.10, 0.004), ("aluminium", "glass")),
    "bowl": (bodies.bowl(0.06, 0.004, AROUND, 14), ("glass", "bronze")),
    "cup": (cup(), ("bronze", "steel")),
    "bracket": (extruded([(0, 0), (0.09, 0), (0.09, 0.006), (0.006, 0.006), (0.006, 0.07), (0, 0.07)], 0.03),
                ("ABS", "aluminium")),
}


@dataclasses.dataclass
class Truth:
    """A body of known material, and its modes."""

    body: str
    material: str
    nu: float
    eigenvalues: numpy.ndarray  # of unit material
    couplings: numpy.ndarray
    shapes: numpy.ndarray  # vertices, 3, modes
    errors: numpy.ndarray  # of the frequencies, by the mesh

    @property
    def young_over_density(self):
        young, density, _ = MATERIALS[self.material]
        return young / density

    @property
    def density(self):
        return MATERIALS[self.material][1]

    def frequencies_hz(self):
        return numpy.sqrt(self.eigenvalues * self.young_over_density) / (2 * math.pi) * (1 - self.errors)

    def decays(self, hz):
        return decays(MATERIALS[self.material][2], hz)


def decays(law, hz):
    """The decay rates of a law at frequencies."""
    kind, figures = law
    omega = 2 * math.pi * numpy.asarray(hz)
    if kind == "eta":
        return figures * omega / 2
    if kind == "rayleigh":
        return (figures[0] * omega**2 + figures[1]) / 2
    table = numpy.log(figures)
    return numpy.exp(numpy.interp(numpy.log(hz), table[:, 0], table[:, 1])) * omega / 2


def force_spectrum(hz, duration_s):
    """That of a raised cosine, which is one at zero."""
    x = hz * duration_s
    near = numpy.abs(x - 1) < 1e-6
    x = numpy.where(near, 0.5, x)
    return numpy.where(near, 0.5, numpy.abs(numpy.sinc(x) / (1 - x**2)))


def pink_noise(count, random):
    spectrum = numpy.fft.rfft(random.standard_normal(count))
    hz = numpy.fft.rfftfreq(count, 1 / RATE_HZ)
    return numpy.fft.irfft(spectrum / numpy.sqrt(numpy.maximum(hz, 20)), count)


def in_room(sound, random, t60_s, level_db):
    """With a diffuse tail whose energy is by `level_db` over the direct sound's."""
    time = numpy.arange(int(t60_s * RATE_HZ)) / RATE_HZ
    tail = random.standard_normal(len(time)) * numpy.exp(-math.log(1000) * time / t60_s)
    tail *= 10 ** (level_db / 20) / numpy.sqrt(numpy.sum(tail**2))
    count = len(sound) + len(tail)
    wet = numpy.fft.irfft(numpy.fft.rfft(sound, count) * numpy.fft.rfft(tail, count), count)
    return sound + wet[:len(sound)]


def strike(truth, frequencies, duration_s, noise_db, room, random, keep=None):
    """The sound of one blow at a random place, at most 20 kHz, as samples of at most 0.9. `room`: None, or its T60 in s
    and its level in dB."""
    time = numpy.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    vertex = random.integers(len(truth.shapes))
    normal = random.standard_normal(3)
    amplitudes = (truth.shapes[vertex].T @ (normal / numpy.linalg.norm(normal)) * truth.couplings
                  * force_spectrum(frequencies, duration_s))
    decay = truth.decays(frequencies)
    sound = numpy.zeros(len(time))
    for mode, hz in enumerate(frequencies):
        if hz < 20000 and (keep is None or keep[mode]):
            sound += amplitudes[mode] * numpy.exp(-decay[mode] * time) * numpy.sin(2 * math.pi * hz * time)
    if room:
        sound = in_room(sound, random, *room)
    lead = int(0.3 * RATE_HZ)
    sound = numpy.concatenate([numpy.zeros(lead), sound])
    level = numpy.sqrt(numpy.mean(sound[lead:lead + int(0.1 * RATE_HZ)] ** 2))
    noise = pink_noise(len(sound), random)
    sound += noise * level * 10 ** (-noise_db / 20) / numpy.sqrt(numpy.mean(noise**2))
    return 0.9 * sound / numpy.max(numpy.abs(sound))
