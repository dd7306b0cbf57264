# SPDX-License-Identifier: Apache-2.0
"""A client that lives again and again: `python3 churning_client.py SERVER MODEL SEED`.

In each life it makes a scene, strikes, and also listens, renders, lists or submits a job. It prints a line for each
life. In 3 % of them it kills itself amid its streams, without a word to the daemon.
"""

import contextlib
import os
import random
import signal
import sys
import threading
import time

import carillon
import meshes

DEATHS = 0.03
STEPS = 10
STEP_S = 0.05


class Churning:
    def __init__(self, server, model, seed):
        self.server = server
        self.model = model
        self.random = random.Random(int(seed))

    def live(self):
        dies = self.random.random() < DEATHS
        act = self.random.choice((self.listen, self.render, self.list_all, self.submit, self.listen))
        last = self.random.randrange(STEPS)
        with carillon.connect(self.server) as self.c, self.c.scene() as scene:
            bar = scene.add(self.model, meshes.MATERIAL)
            with scene.stream(step=STEP_S) as stream:
                for number in range(STEPS):
                    stream.step(number * STEP_S, impacts=self.impact(bar))
                    if number == last:
                        act(dies)
                    time.sleep(STEP_S)

    def impact(self, bar):
        return carillon.Impacts(bar, [(0, 0, meshes.BAR_SIZE[2])], [(0, 0, -self.random.uniform(1e-4, 1e-3))])

    @staticmethod
    def die():
        os.kill(os.getpid(), signal.SIGKILL)

    def listen(self, dies):
        with self.c.recording() as record:
            record.take(0.05)
            if dies:
                self.die()

    def render(self, dies):
        trace = carillon.Trace(step=STEP_S)
        bar = trace.add(self.model, meshes.MATERIAL)
        for number in range(20):
            trace.step(number * STEP_S, impacts=self.impact(bar))
        if dies:
            threading.Timer(0.005, self.die).start()
        try:
            self.c.render(trace, tail_s=1)
        except carillon.CarillonError as error:
            # More clients render than the daemon serves at once.
            if error.reason != "TOO_MANY_CALLS":
                raise

    def list_all(self, dies):
        for items in (self.c.models(), self.c.jobs(), self.c.scenes()):
            list(items)
        self.c.status()
        if dies:
            self.die()

    def submit(self, dies):
        """A small job, which is cancelled, or followed to its end; its model is deleted."""
        job = self.c.create_job(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL,
                                settings={"mesh": {"target_node_count": self.random.randrange(300, 340)}})
        if dies:
            self.die()
        cancels = self.random.random() < 0.5
        with contextlib.suppress(carillon.CarillonError):  # another client may have cancelled or deleted it
            if cancels:
                job.cancel()
            else:
                job.wait().delete()


def main():
    churning = Churning(*sys.argv[1:])
    while True:
        churning.live()
        print("lived", flush=True)


if __name__ == "__main__":
    main()
