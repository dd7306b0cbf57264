# SPDX-License-Identifier: Apache-2.0
"""A session as a simulator has it: bodies that are struck, dragged and leant on for some minutes, played through
JACK under a competing load; what JACK was given, and what the trace of the same contacts sounds like offline."""

import json
import math
import os
import random
import subprocess
import threading
import time

import jack
import meshes
import numpy
from carillon.v1 import (
    audio_service_pb2, contact_pb2, contact_service_pb2, contact_trace_pb2, decomposition_pb2,
    decomposition_service_pb2, material_pb2, modal_model_pb2, scene_service_pb2)
from daemon import Daemon

STEP_S = 1 / 240
# Python, on a machine whose every core is busy, is late by that much now and then.
DELAY_S = 2.0
# JACK's own deadline, which is not the daemon's: a kernel that is not preempted everywhere keeps a thread of the
# highest priority waiting for some milliseconds, now and then.
JACK_PERIOD_FRAMES = 512
TAIL_S = 1.0
UNFINISHED = (decomposition_pb2.JOB_STATE_QUEUED, decomposition_pb2.JOB_STATE_RUNNING)
BODIES = ((meshes.bar, "chime_aluminum", 1.0, 20), (meshes.bar, "oak", 1.4, 20), (meshes.bowl, "porcelain", 1.0, 50),
          (meshes.tube, "chime_aluminum", 1.0, 5), (meshes.bowl, "chime_aluminum", 0.7, 20))


def vector(x, y, z):
    return contact_pb2.Vec3(x=x, y=y, z=z)


class Contacts:
    """The steps of the simulation, the same for each seed."""

    def __init__(self, seed=1):
        self.random = random.Random(seed)

    def place(self):
        return contact_pb2.SurfacePoint(triangle=self.random.randrange(12), weight1=self.random.random() / 2,
                                        weight2=self.random.random() / 2)

    def impulse(self):
        direction = [self.random.gauss(0, 1) for _ in range(3)]
        strength = 0.0006 * math.exp(self.random.gauss(0, 1))
        return contact_pb2.Contact(
            kind=contact_pb2.CONTACT_KIND_IMPACT, object=self.random.randint(1, len(BODIES)),
            surface_point=self.place(),
            impulse_newton_seconds=vector(*(strength * x for x in direction)),
            duration_s=self.random.choice((0, 1e-4, 5e-4, 2e-3)), time_offset_s=STEP_S * self.random.random())

    def drag(self, time_s):
        """Over a rough floor, and at times it rests."""
        speed = max(0.0, 0.2 * math.sin(time_s))
        return contact_pb2.Contact(
            kind=contact_pb2.CONTACT_KIND_FORCE, object=2,
            surface_point=contact_pb2.SurfacePoint(triangle=0, weight1=0.2, weight2=0.3),
            force_newtons=vector(0.5 * speed, 0, 1), roughness=contact_pb2.Roughness(
                travel_speed_m_per_s=speed, depth=0.5))

    def engine_contact(self, step):
        """A weight that jitters as engines' do, and falls anew every second."""
        newton_seconds = STEP_S * (1 + self.random.gauss(0, 0.02)) * (20 if step % 240 == 0 else 1)
        return contact_pb2.Contact(
            object=3, surface_point=contact_pb2.SurfacePoint(triangle=5, weight1=0.4, weight2=0.3),
            impulse_newton_seconds=vector(0, 0, newton_seconds), partner=7, duration_s=1e-3)

    def step(self, number):
        time_s = number * STEP_S
        step = contact_pb2.ContactStep(time_s=time_s, contacts=[self.drag(time_s), self.engine_contact(number)])
        step.contacts.extend(self.impulse() for _ in range(self.random.choice((0, 0, 0, 1, 2))))
        return step


class CompetingLoad(threading.Thread):
    """A busy loop for each core, at the daemon's own niceness, and one decomposition after the other. The loops end
    with this process, whatever ends it."""

    def __init__(self, client):
        super().__init__()
        self.client = client
        self.loops = [subprocess.Popen(["/bin/sh", "-c", f"while kill -0 {os.getpid()}; do :; done"])
                      for _ in range(os.cpu_count() or 1)]
        self.job_count = 0
        self.stopped = threading.Event()

    def run(self):
        while not self.stopped.is_set():
            self.job_count += 1
            mesh = modal_model_pb2.MeshSettings(target_node_count=6000 + self.job_count)
            job = self.client.create(
                meshes.bar(), "obj", material=material_pb2.Material(preset=meshes.MATERIAL),
                settings=modal_model_pb2.DecompositionSettings(mesh=mesh)).name
            request = decomposition_service_pb2.GetJobRequest(name=job)
            while self.client.jobs.GetJob(request).job.state in UNFINISHED and not self.stopped.wait(0.5):
                pass
        self.client.jobs.CancelJob(decomposition_service_pb2.CancelJobRequest(name=job))

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.stopped.set()
        for loop in self.loops:
            loop.kill()
            loop.wait()
        self.join()


class XrunWatch(threading.Thread):
    """When the daemon counted xruns, and when the machine itself stood still, so that nothing on it could be in time:
    see watch_standstills.cc. A JACK cycle that late is nobody's on the machine."""

    POLL_S = 0.2
    LEAST_MS = 1000 * JACK_PERIOD_FRAMES / jack.RATE / 2

    def __init__(self, client):
        super().__init__()
        self.client = client
        self.xruns = []  # the time before, the time after, how many
        self.standstills = []
        self.stopped = threading.Event()

    def count(self):
        return self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest()).xrun_count

    def run(self):
        count, begin_s = self.count(), time.monotonic()
        while not self.stopped.wait(self.POLL_S):
            now, now_s = self.count(), time.monotonic()
            if now > count:
                self.xruns.append((begin_s, now_s, now - count))
            count, begin_s = now, now_s

    def __enter__(self):
        self.machine = subprocess.Popen([jack.PROGRAMS / "watch_standstills", str(self.LEAST_MS)], text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self.machine.stdout.readline() == "watching\n"
        self.start()
        return self

    def __exit__(self, *_):
        self.stopped.set()
        self.join()
        printed = json.loads(self.machine.communicate()[0])  # which ends its standard input
        self.standstills = printed["standstills"] if printed["realtime"] else []

    def excused(self):
        """Xruns told of at most a poll after a standstill."""
        return sum(count for begin_s, end_s, count in self.xruns
                   if any(begin < end_s and end > begin_s - self.POLL_S for begin, end in self.standstills))

    def longest_ms(self):
        return max((1000 * (end - begin) for begin, end in self.standstills), default=0)


class Session:
    """A JACK server, and a daemon with bodies that can be struck, in `folder`."""

    def __init__(self, folder):
        self.folder = folder
        self.jack = jack.Jack(JACK_PERIOD_FRAMES)
        self.daemon = Daemon(folder, "--audio-device", jack.DEVICE, environment=self.jack.environment)
        self.client = self.daemon.client()
        self.objects = [self.make_object(handle, *body) for handle, body in enumerate(BODIES, start=1)]
        self.steps = []

    def stop(self):
        self.daemon.stop()
        self.jack.stop()

    def make_object(self, handle, mesh, material, size, alpha2_per_s):
        figures = material_pb2.Material(preset=material, alpha2_per_s=alpha2_per_s)
        model = self.client.wait(self.client.create(mesh(), "obj", material=figures))
        return contact_trace_pb2.ContactTraceObject(handle=handle, modal_model=model, material=figures, size=size,
                                                    gain=1)

    def allows_realtime(self):
        return "REALTIME_NOT_ALLOWED" not in (self.folder / "log").read_text()

    def play(self, seconds):
        """Plays live; (what JACK was given, what was counted, the last answer to the contacts)."""
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        for item in self.objects:
            self.client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
                scene=scene,
                objects=[scene_service_pb2.NewObject(modal_model=item.modal_model, material=item.material,
                    size=item.size, gain=item.gain, handle=item.handle)]))
        recording = self.folder / "capture.float32"
        recorder = subprocess.Popen(
            [jack.PROGRAMS / "record_jack", jack.PORT, str(seconds + 60), recording], env=self.jack.environment,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert recorder.stdout.readline() == "recording\n"
        before = self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest())
        with XrunWatch(self.client) as watch, CompetingLoad(self.client) as load:
            *_, answer = self.client.contacts.StreamContacts(self.requests(scene, seconds))
            time.sleep(DELAY_S + TAIL_S + 0.5)
        mixer = self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest())
        printed, _ = recorder.communicate()  # which ends its standard input
        found = {"missed_cycles": json.loads(printed)["missed_cycles"], "decompositions": load.job_count,
                 "merged_or_shed": mixer.merged_impulse_count + mixer.shed_impulse_count + mixer.shed_object_count,
                 "limited_frames": mixer.limited_frame_count, "xruns": mixer.xrun_count - before.xrun_count,
                 "xruns_of_standstills": watch.excused(), "standstills": len(watch.standstills),
                 "longest_standstill_ms": watch.longest_ms(),
                 "lost_frames": mixer.lost_frame_count - before.lost_frame_count}
        return numpy.fromfile(recording, numpy.float32), found, answer

    def requests(self, scene, seconds):
        """In real time, as the simulation goes."""
        request = contact_service_pb2.StreamContactsRequest
        yield request(start=contact_service_pb2.ContactStreamStart(scene=scene, step_s=STEP_S,
                                                                   scheduling_delay_s=DELAY_S))
        contacts = Contacts()
        begin_s = time.monotonic()
        for number in range(int(seconds / STEP_S)):
            time.sleep(max(0.0, begin_s + number * STEP_S - time.monotonic()))
            self.steps.append(contacts.step(number))
            yield request(steps=[self.steps[-1]])

    def render(self, answer):
        """The trace of what was played, rendered offline."""
        clock = contact_trace_pb2.ContactTraceClock(first_frame=answer.first_frame, first_time_s=0,
                                                    scheduling_delay_s=answer.scheduling_delay_s)
        header = contact_trace_pb2.ContactTraceHeader(format_version=1, simulator="session", step_s=STEP_S,
                                                      clock=clock)
        record = contact_trace_pb2.ContactTraceRecord
        records = [record(header=header), *(record(object=item) for item in self.objects),
                   *(record(step=step) for step in self.steps)]
        request = audio_service_pb2.RenderRequest
        settings = audio_service_pb2.RenderSettings(sample_rate_hz=jack.RATE, tail_s=TAIL_S)
        requests = [request(settings=settings), *(request(record=item) for item in records)]
        answers = self.client.audio.Render(iter(requests))
        return numpy.frombuffer(b"".join(item.block.samples for item in answers), numpy.float32)

    def run(self, seconds):
        """What became of it, as figures."""
        captured, counted, answer = self.play(seconds)
        return {"seconds": seconds, "realtime": self.allows_realtime(), "rejected": answer.rejected_count,
                "late": answer.late_count, "dropped": answer.dropped_count, "accepted": answer.accepted_count,
                **counted, **compare(captured, self.render(answer))}


def compare(captured, rendered):
    """Lays one over the other by their first sounds."""
    begin = int(numpy.argmax(captured != 0)) - int(numpy.argmax(rendered != 0))
    piece = captured[max(begin, 0):][:len(rendered)]
    differing = numpy.flatnonzero(piece.view(numpy.uint32) != rendered[:len(piece)].view(numpy.uint32))
    return {"frames": len(piece), "rendered_frames": len(rendered), "differing_frames": len(differing),
            "first_difference": int(differing[0]) if len(differing) else None,
            "sounding_frames": int(numpy.count_nonzero(rendered)), "peak": float(numpy.abs(rendered).max())}
