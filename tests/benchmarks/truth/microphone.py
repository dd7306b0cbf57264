# SPDX-License-Identifier: Apache-2.0
"""What a microphone near a struck body hears.

A rendered sound has each mode as loud as it is on average over all directions at 1 m. The stored transfer holds more:
the field of each mode at every place outside the sphere around the body. The sound is therefore taken apart into its
modes, whose frequencies and decays are known, and each is given the strength and the phase of its field at the
microphone."""

import math

import numpy
from scipy import special

import rings

DISTANCES_M = (0.06, 0.1, 0.2, 1.0)
# Half a sphere: the fields of bending and torsion are the same below the bar, but for their sign.
POLAR_DEGREES, AROUND_DEGREES = range(0, 91, 15), range(0, 360, 30)


def harmonics(index, polar, azimuth):
    """Y_lm of proto/carillon/v1/transfer.proto, at l^2 + l + m, in directions."""
    order = math.isqrt(index)
    degree = index - order * order - order
    m = abs(degree)
    scale = math.sqrt((2 * order + 1) / (4 * math.pi) * math.factorial(order - m) / math.factorial(order + m))
    turned = numpy.sin(m * azimuth) if degree < 0 else numpy.cos(m * azimuth)
    # (-1)^m takes the phase of Condon and Shortley out of lpmv.
    return (1 if m == 0 else math.sqrt(2)) * (-1)**m * scale * turned * special.lpmv(m, order, numpy.cos(polar))


def outgoing(order, x):
    """h_l(x) exp(-i x): the delay of the distance is left to whoever needs it."""
    return (special.spherical_jn(order, x) + 1j * special.spherical_yn(order, x)) * numpy.exp(-1j * x)


def places():
    """(distance, polar angle, azimuth) of each microphone that is tried."""
    return numpy.array([(distance, math.radians(polar), math.radians(around))
                        for distance in DISTANCES_M for polar in POLAR_DEGREES
                        for around in (AROUND_DEGREES if polar else (0,))])


class Microphones:
    """Places around a body of one material, and the field of each mode there. `transfer`: what scripted.read_transfer
    returns."""

    def __init__(self, transfer, material, young_pa, density_kg_per_m3):
        air, arrays = transfer
        self.places = places()
        self.computed = numpy.flatnonzero(arrays["states"] == 1)
        omega = numpy.sqrt(arrays["eigenvalues"][self.computed] * young_pa / density_kg_per_m3)
        self.wavenumbers = omega / air.sound_speed_m_per_s
        radiated = (air.air_density_kg_per_m3 * air.sound_speed_m_per_s * self.wavenumbers**2 / 2
                    * arrays["power_integrals"][self.computed] / density_kg_per_m3)
        decay = numpy.array([material.decay_per_s(w / (2 * math.pi)) for w in omega]) + radiated
        self.rates = -decay + 1j * numpy.sqrt(omega**2 - decay**2)
        self.fields = numpy.array([self.field(arrays, number) for number in range(len(self.computed))])

    def field(self, arrays, number):
        """A mode's field at each place over its mean pressure at 1 m."""
        mode = self.computed[number]
        distance, polar, azimuth = self.places.T
        found = numpy.zeros(len(distance), complex)
        for i in range(arrays["first"][mode], arrays["first"][mode + 1]):
            index = int(arrays["harmonics"][i])
            real, imaginary = arrays["coefficients"][i]
            found += ((real + 1j * imaginary) * harmonics(index, polar, azimuth)
                      * outgoing(math.isqrt(index), self.wavenumbers[number] * distance))
        return found / math.sqrt(arrays["power_integrals"][mode] / (4 * math.pi))

    def hear(self, sound):
        """Yields (place, what a microphone hears there) for each place."""
        modes = numpy.exp(numpy.outer(self.rates, numpy.arange(len(sound)) / rings.RATE_HZ))
        basis = numpy.concatenate([modes.real, -modes.imag])
        parts = numpy.linalg.lstsq(basis.T, sound, rcond=None)[0].reshape(2, -1)
        amplitudes = parts[0] + 1j * parts[1]
        # Fields are for the time exp(-i omega t), rates for exp(i omega t).
        for place, field in zip(self.places, self.fields.T):
            yield place, ((amplitudes * field.conj()) @ modes).real
