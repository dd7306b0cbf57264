# SPDX-License-Identifier: Apache-2.0
"""The steps of performed.cc by the package for Python."""

import numpy

import carillon

STEPS_BEFORE = 20


class Performed:
    """Environments with some bodies of one model, all of which move in each step, and one of which is struck."""

    def __init__(self, client, model, environments, bodies, step_s):
        self.bodies, self.own = bodies, numpy.arange(environments)
        self.every = numpy.repeat(self.own, bodies)
        self.handles = numpy.tile(numpy.arange(1, bodies + 1), environments)
        self.sound = client.perform(step=step_s, environments=environments,
                                    microphones=[carillon.Omni(at=(0, 0, 1.5))])
        for handle in range(1, bodies + 1):
            self.sound.add(model, handle=handle)

    def step(self, number):
        """The samples of step `number`."""
        count = len(self.own)
        positions = numpy.column_stack([0.1 * self.handles, 0 * self.handles, 1e-4 * number + 0 * self.handles])
        blows = carillon.Impacts(1 + (self.own + number) % self.bodies, numpy.tile([0, 0.008, 0.01], (count, 1)),
                                 numpy.tile([0, 0, -0.002], (count, 1)), durations=1e-4, environments=self.own)
        poses = carillon.Poses(self.handles, positions, environments=self.every)
        return self.sound.step(impacts=blows, poses=poses)[0]
