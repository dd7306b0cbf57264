# SPDX-License-Identifier: Apache-2.0
"""What the programs of this folder share. Each runs short as a test, and long by deploy/torture.sh."""

import contextlib
import os
import threading
import time

import meshes
import sound
from carillon.v1 import audio_service_pb2, contact_pb2, contact_service_pb2
from daemon import ScratchTest, resident_mib

LONG = os.environ.get("CARILLON_TORTURE") == "long"
# On a busy machine a test must only end; deploy/torture.sh measures.
STOP_S = 5.0 if LONG else 30.0


def rounds(short, long):
    return long if LONG else short


class ServedTest(ScratchTest):
    def stop_in_time(self):
        begin_s = time.monotonic()
        self.assertEqual(self.daemon.stop(), 0)
        taken_s = time.monotonic() - begin_s
        print(f"stopped within {taken_s:.2f} s", flush=True)
        self.assertLess(taken_s, STOP_S)

    def calls(self, call, seconds):
        """The durations of `call`, a GetMixer, fifty a second at most, and the daemon's largest memory meanwhile."""
        times, most_mib = [], 0.0
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            begin_s = time.monotonic()
            call(audio_service_pb2.GetMixerRequest(), timeout=30)
            times.append(time.monotonic() - begin_s)
            most_mib = max(most_mib, resident_mib(self.daemon.process))
            time.sleep(0.02)
        return times, most_mib


class SoundingScene:
    """A bar that is struck twenty times a second, by one stream of contacts, and one listener, until `stop`."""

    PERIOD_S = 0.05

    def __init__(self, daemon):
        self.client = daemon.client()
        self.scene, struck = self.client.scene(self.client.model())
        self.impulse = sound.impulse((0, 0, meshes.BAR_SIZE[2]), (0, 0, -0.001), struck.handle, duration_s=None)
        self.stopped = threading.Event()
        self.answer = contact_service_pb2.StreamContactsResponse()
        self.heard = audio_service_pb2.ListenResponse()
        self.threads = [threading.Thread(target=self._strike), threading.Thread(target=self._listen)]
        for thread in self.threads:
            thread.start()

    def _requests(self):
        request = contact_service_pb2.StreamContactsRequest
        yield request(start=contact_service_pb2.ContactStreamStart(scene=self.scene, step_s=self.PERIOD_S))
        begin_s = time.monotonic()
        step = 0
        while not self.stopped.wait(max(0.0, begin_s + step * self.PERIOD_S - time.monotonic())):
            yield request(steps=[contact_pb2.ContactStep(time_s=step * self.PERIOD_S, contacts=[self.impulse])])
            step += 1

    def _strike(self):
        with contextlib.suppress(Exception):  # the daemon may stop first
            for self.answer in self.client.contacts.StreamContacts(self._requests()):
                pass

    def _listen(self):
        with contextlib.suppress(Exception):
            for self.heard in self.client.audio.Listen(audio_service_pb2.ListenRequest()):
                if self.stopped.is_set():
                    return

    def mixer(self):
        return self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest())

    def stop(self):
        self.stopped.set()
        for thread in self.threads:
            thread.join()
