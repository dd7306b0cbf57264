# SPDX-License-Identifier: Apache-2.0
"""The Python package against the real daemon: what it is, scenes with ids, all jobs, what a rendering tells, and
mistakes of a caller."""

import asyncio
import os
import subprocess
import sys
import time
import warnings

import numpy

import carillon
import meshes
from certificates import SecuredTest, access_line
from daemon import ScratchTest
from test_python_package import BAR, DURATION_S, IMPULSE, POINT, PackageTest


def run_script(script, **environment):
    """The words that a program in Python prints."""
    done = subprocess.run([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, check=True, timeout=60,
                          env={**os.environ, **environment})
    return done.stdout.split()


class CallsTest(PackageTest):
    def test_the_daemon_says_what_it_is(self):
        async def ask():
            async with carillon.aio.connect(self.daemon.server) as c:
                return await c.info()

        info, later = self.c.info(), asyncio.run(ask())
        self.assertEqual((info.version, info.limits), (carillon.__version__, later.limits))
        self.assertGreater(later.uptime_s, info.uptime_s)
        self.assertLessEqual({"decomposition", "binaural"}, set(info.features))
        self.assertEqual(info.sample_rate_hz, self.c.status().format.sample_rate_hz)

    def test_a_scene_with_two_ears_warns_if_the_daemon_plays_one_channel(self):
        for effect in "panning", "binaural":
            with self.assertWarnsRegex(carillon.HearingWarning, r"^scenes/\d+ has panning or two ears, but the daemon "
                                       r"plays one channel, which has neither; start it by `carillond --channels "
                                       r"2`$") as told:
                self.c.scene(hearing={effect: True}).delete()
            self.assertEqual((told.filename, len(told.warnings)), (__file__, 1))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.c.scene(hearing={"distance_gain": True}).delete()

    def test_a_scene_with_an_id_is_found_again_with_its_objects(self):
        made = self.c.scene(id="lathe-1", gain=0.5)
        self.assertEqual((made.name, made.existing), ("scenes/lathe-1", False))
        made.add_all([self.model, {"model": self.model, "handle": 7, "gain": 2}])
        with self.assert_refused("OBJECT_EXISTS") as raised:
            made.add_all([self.model, {"model": self.model, "handle": 7}])
        self.assertEqual(raised.exception.metadata["index"], "1")
        # Another connection, as after a loss of this one.
        with carillon.connect(self.daemon.server) as other, other.scene(id="lathe-1", gain=0.5) as again:
            self.assertTrue(again.existing)
            self.assertEqual([item.handle for item in again.objects()], [1, 7])
            self.assertEqual((again.get().object_count, again.get().gain), (2, 0.5))
            with self.assert_refused("SCENE_DIFFERS"):
                other.scene(id="lathe-1")
        with self.assert_refused("SCENE_NOT_FOUND"):
            made.get()

    def test_jobs_are_watched_and_filtered(self):
        changes = self.c.watch_jobs(label_contains="watched")
        self.assertIsNone(next(changes))
        size = 1.01 * numpy.array(meshes.BAR_SIZE)
        self.c.create_job(meshes.box(size), meshes.MATERIAL, label="Watched bar", without_transfer=True)
        states = []
        while not states or states[-1] != "succeeded":
            states.append(next(changes).state)
        changes.close()
        self.assertEqual(states, sorted(states, key=["queued", "running", "succeeded"].index))
        self.assertEqual([job.message.label for job in self.c.jobs(["succeeded"], "WATCHED")], ["Watched bar"])
        self.assertEqual(list(self.c.jobs(["failed"])), [])

        async def watch():
            async with carillon.aio.connect(self.daemon.server) as c:
                self.assertEqual([job.state async for job in c.jobs(label_contains="watched")], ["succeeded"])
                async for job in c.watch_jobs(states=["queued"]):
                    return job

        self.assertIsNone(asyncio.run(watch()))

    def test_a_rendering_tells_its_blows(self):
        trace = self.struck(0.25)
        self.assertEqual(self.c.render(trace, tail_s=0.1).blows, ())
        blow, = self.c.render(trace, tail_s=0.1, tell_blows=True).blows
        self.assertAlmostEqual(blow.time_s, 0.25)
        self.assertAlmostEqual(blow.duration_s, DURATION_S)

    def test_times_in_milliseconds_are_refused_and_rare_strikes_are_not(self):
        def trace(step_s, **content):
            made = carillon.Trace(step_s)
            bar = made.add(self.model)
            for i in range(13):
                made.step(1000 * i * step_s, **{name: kind(bar) for name, kind in content.items()})
            return made

        def impact(bar):
            return carillon.Impacts(bar, POINT, IMPULSE, durations=DURATION_S)

        moving = trace(1 / 240, impacts=impact, poses=lambda bar: carillon.Poses(bar, [(0, 0, 0)]))
        with self.assert_refused("TRACE_MALFORMED", "milliseconds"):
            self.c.render(moving)
        with self.assertWarns(carillon.ContactWarning):  # STEP_TOO_SHORT
            self.assertEqual(self.c.render(trace(1 / 1000, impacts=impact), tail_s=0.1).samples.size, 12.1 * 48000)

    def test_a_rendering_ends_at_its_timeout_and_by_an_interrupt(self):
        trace = self.struck(0, 80000)
        with self.assert_refused("DEADLINE_EXCEEDED"):
            self.c.render(trace, timeout=0.3)
        file = self.folder / "long.contacts"
        trace.write(file)
        script = ("import carillon, os, signal, sys, threading\n"
                  "threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
                  "carillon.connect(sys.argv[1]).render(sys.argv[2])\n")
        done = subprocess.run([sys.executable, "-c", script, self.daemon.server, file], stderr=subprocess.PIPE,
                              text=True, timeout=60)
        self.assertTrue(done.stderr.rstrip().endswith("KeyboardInterrupt"), done.stderr)

    def test_soft_and_limited_sounds_are_normalised_alike(self):
        sound, *others = (self.c.render(self.struck(0.0, factor=factor), normalize=True, tail_s=0.3)
                          for factor in (1, 1e-5, 1e4))
        for other in others:
            numpy.testing.assert_allclose(other.samples, sound.samples, atol=1e-4)

    def test_a_trace_sounds_as_its_stream_but_for_the_scheduling_delay(self):
        step_s, hit = 1 / 240, 6
        for kind, is_sent, blow_s in (
                # A blow is over one step after it, and then sounds. One after a gap is a blow by itself.
                ("contacts", lambda number: True, (hit + 1) * step_s),
                ("contacts", lambda number: number in (0, hit), hit * step_s),
                ("impacts", lambda number: True, hit * step_s)):
            with self.subTest(kind=kind, blow_s=blow_s):
                sent = getattr(carillon, kind.capitalize())(1, POINT, IMPULSE, durations=DURATION_S)
                steps = [(number * step_s, {kind: sent} if number == hit else {})
                         for number in range(12) if is_sent(number)]
                offline, live = self.blow_offline_s(steps, step_s), self.blow_live_s(steps, step_s)
                self.assertAlmostEqual(offline, blow_s, delta=1e-4)
                self.assertAlmostEqual(live, blow_s, delta=1e-4)

    def blow_offline_s(self, steps, step_s):
        """When the blow of the steps sounds in a rendering, on the simulation's clock."""
        trace = carillon.Trace(step_s)
        trace.add(self.model, handle=1)
        for time_s, content in steps:
            trace.step(time_s, **content)
        blow, = self.c.render(trace, tail_s=0.1, tell_blows=True).blows
        return blow.time_s

    def blow_live_s(self, steps, step_s):
        """The same of a stream, without the delay that it states."""
        with self.c.scene() as scene, self.c.recording(scene=scene.name) as record:
            scene.add(self.model, handle=1)
            # The delay lets all steps come at once.
            with scene.stream(step_s, delay=0.5) as stream:
                for time_s, content in steps:
                    stream.step(time_s, **content)
            heard = record.take(1)
        begin_frame = heard.first_frame + int(numpy.flatnonzero(heard.samples)[0])
        # The pulse begins half a duration before the time of the blow.
        return (begin_frame - stream.report.first_frame) / heard.sample_rate_hz - 0.5 + DURATION_S / 2

    def test_contacts_that_come_late_are_told_once(self):
        with self.c.scene() as scene:
            scene.add(self.model, handle=1)
            with self.assertWarns(carillon.ContactWarning) as told:
                with scene.stream(step=1 / 240, delay=0) as stream:
                    stream.step(0.0)
                    self.c.listen(0.1)
                    stream.step(0.0, impacts=carillon.Impacts(1, POINT, IMPULSE, durations=DURATION_S))
        self.assertEqual([(one.message.id, one.message.count, one.message.figures) for one in told.warnings],
                         [("CONTACTS_LATE", 1, {"scheduling_delay_s": 0})])
        self.assertEqual((stream.late_count, stream.remap_count), (1, 0))

    def test_a_scene_that_is_gone_hides_no_exception_of_its_block(self):
        with self.c.scene() as scene:
            scene.delete()
        with self.assertRaises(KeyError), self.c.scene() as scene:
            scene.delete()
            raise KeyError

    def test_models_jobs_and_objects_of_asyncio_are_awaited(self):
        async def use():
            async with carillon.aio.connect(self.daemon.server) as c, await c.scene() as scene:
                job = await c.create_job(BAR, meshes.MATERIAL)
                model = await job.wait()
                bar, other = await scene.add_all([model, {"model": model, "handle": 7}])
                await other.update(gain=0.5)
                await bar.strike(POINT, IMPULSE, DURATION_S)
                await other.remove()
                return ((await job.refresh()).state, await model.frequencies(), (await c.render(self.struck(0.0))).peak,
                        (await model.render_strike(POINT, IMPULSE, duration=DURATION_S)).peak,
                        [item.handle for item in await scene.objects()])

        state, frequencies, *peaks, handles = asyncio.run(use())
        self.assertEqual((state, handles), ("succeeded", [1]))
        numpy.testing.assert_array_equal(frequencies, self.model.frequencies())
        self.assertEqual(*peaks)

    def test_more_renderings_than_a_client_may_have_wait_in_asyncio(self):
        async def render():
            async with carillon.aio.connect(self.daemon.server) as c:
                model, trace = await c.model("bar"), self.struck(0.0)
                limits = (await c.info()).limits
                sounds = await asyncio.gather(
                    *(model.render_strike(POINT, IMPULSE, duration=DURATION_S, seconds=0.1) for _ in range(8)),
                    *(c.render(trace, tail_s=0.1) for _ in range(8)))
                return int(limits.rendering_count * limits.client_share), {sound.peak for sound in sounds}

        share, peaks = asyncio.run(render())
        self.assertEqual((share, len(peaks)), (4, 1))

    def test_streams_and_recordings_of_asyncio_are_awaited(self):
        async def use():
            async with carillon.aio.connect(self.daemon.server) as c, await c.scene() as scene:
                bar = await scene.add(await c.model("bar"))
                self.assertEqual((await scene.update(gain=0.5)).gain, 0.5)
                async with c.recording() as record, scene.recording_contacts() as contacts:
                    stream = scene.stream(step=1 / 240)
                    await stream.step(0.0, impacts=carillon.Impacts(bar, POINT, IMPULSE, durations=DURATION_S))
                    report = await stream.close()
                    with self.assertRaisesRegex(carillon.CarillonError, "CONTACT_STREAM_ENDED"):
                        await stream.step(1.0)
                    heard, trace = await record.take(0.3), await contacts.take()
                    with self.assertRaises(asyncio.TimeoutError):
                        await asyncio.wait_for(record.take(3600), 0.1)
                self.assertEqual((stream.waiting_step_count, stream.dropped_step_count), (0, 0))
                return report.accepted_count, heard.peak, len(trace.steps)

        accepted, peak, step_count = asyncio.run(use())
        self.assertEqual((accepted, step_count), (1, 1))
        self.assertGreater(peak, 1e-5)

    def test_a_pool_of_forked_processes_uses_the_connection_and_passes_refusals_on(self):
        said = run_script(f"""
import multiprocessing, carillon
c = carillon.connect({self.c.server!r})
c.status()
def ask(text):
    return c.model(text).mode_count
with multiprocessing.get_context("fork").Pool(2) as pool:
    print(pool.map(ask, ["bar"] * 4)[3])
    try:
        pool.map(ask, ["bar", "bell"])
    except carillon.CarillonError as error:
        print(error.reason)
print(c.model("bar").mode_count)
""", GRPC_ENABLE_FORK_SUPPORT="1")
        self.assertEqual(said, [str(self.model.mode_count), "MODAL_MODEL_NOT_FOUND", str(self.model.mode_count)])

    def test_a_fork_that_grpc_does_not_survive_is_refused_in_the_child(self):
        said = run_script(f"""
import os, carillon
c = carillon.connect({self.c.server!r})
c.status()
child = os.fork()
if child == 0:
    for call in c.status, carillon.connect:
        try:
            call()
        except RuntimeError as error:
            os.write(1, b"refused " if "GRPC_ENABLE_FORK_SUPPORT=1" in str(error) else b"")
    os._exit(0)
os.waitpid(child, 0)
""", GRPC_ENABLE_FORK_SUPPORT="")
        self.assertEqual(said, ["refused", "refused"])

    def test_no_transfer_means_no_decay_by_radiation(self):
        numpy.testing.assert_array_equal(self.model.radiation_decays(), numpy.zeros(self.model.mode_count))


class MistakesTest(PackageTest):
    """Mistakes of a caller that would otherwise stay silent."""

    def test_a_stream_that_is_not_closed_is_told_at_the_end_of_the_program(self):
        script = ("import carillon, time\n"
                  f"c = carillon.connect({self.c.server!r})\n"
                  "scene = c.scene()\n"
                  f"bar = scene.add({self.model.name!r})\n"
                  "stream = scene.stream(step=1 / 240)\n"
                  "for i in range(160):\n"
                  "    stream.step(i / 240, contacts=carillon.Contacts(bar, [(90, 0, 0)], [(0, 0, -1e-3)]))\n"
                  "    time.sleep(1 / 240)\n")
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60)
        self.assertIn("ContactWarning: STREAM_NOT_CLOSED: ", done.stderr)
        self.assertIn("ContactWarning: POINTS_DISTANT: ", done.stderr)

    def test_mistakes_that_were_silent_are_refused(self):
        trace = carillon.Trace(step=1 / 240)
        trace.add(self.model)
        with self.c.scene() as scene:
            bar = scene.add(self.model)
            for objects in (bar, [bar]):
                with self.assertRaisesRegex(ValueError, "which is not in the trace; give what Trace.add returned"):
                    trace.step(0, impacts=carillon.Impacts(objects, [(0, 0, 0)], [(0, 0, -1e-3)]))
        for step_s in (-1, 4.17, 1e-9, float("nan")):
            wrong = carillon.Trace(step=step_s)
            wrong.step(0, impacts=carillon.Impacts(wrong.add(self.model), [(0, 0, 0)], [(0, 0, -1e-3)]))
            with self.assertRaisesRegex(carillon.CarillonError, "step_s is .*; say the simulator's step, from 1e-6"):
                self.c.render(wrong)
        with self.assertRaisesRegex(ValueError, r"must end with \.wav"):
            carillon.Sound(numpy.zeros((1, 1)), 48000, 0).save(self.folder / "x.mp3")
        with self.assertRaisesRegex(ValueError, "seconds is -1; it must be more than 0"):
            self.c.listen(-1)
        for address in ("/run/carillond.sock", "http://localhost:1"):
            with self.assertRaisesRegex(ValueError, '"unix:PATH" or "HOST:PORT"'):
                carillon.connect(address)


class SceneThatEndsTooEarlyTest(PackageTest):
    """Has a daemon of its own, which must be silent before."""

    def test_an_accepted_impulse_sounds_only_if_its_scene_lasts_until_it_is_due(self):
        for waits in (False, True):
            with self.c.recording() as record:
                with self.c.scene() as scene:
                    with scene.stream(step=0.001, delay=1) as stream:
                        stream.step(0, impacts=carillon.Impacts(scene.add(self.model), [POINT], [IMPULSE]))
                    self.assertEqual((stream.report.accepted_count, stream.findings.blow_count), (1, 0))
                    if waits:  # as docs/ten_minutes_python.md says
                        time.sleep(stream.report.ahead_s + 0.1)
                        self.assertGreater(scene.get().active_mode_count, 0)
                        while scene.get().active_mode_count:
                            time.sleep(0.1)
                self.assertEqual(record.take(2).peak > 0, waits)  # it is due after 1 s


class OwnDaemonTest(ScratchTest):
    def test_two_ears_need_no_warning_where_the_daemon_plays_two_channels(self):
        self.serve("--channels", 2)
        with carillon.connect(self.daemon.server) as c, warnings.catch_warnings():
            warnings.simplefilter("error")
            c.scene(hearing={"panning": True, "binaural": True}).delete()

    def test_a_program_goes_on_with_the_same_client_when_its_daemon_has_started_anew(self):
        self.serve()
        with carillon.connect(self.daemon.server) as c:
            model = c.create_model(BAR, meshes.MATERIAL)
            with self.assertRaises(carillon.ServerUnavailable) as lost, c.scene() as scene, \
                    scene.stream(step=0.01) as stream:
                for number in range(1000):
                    stream.step(0.01 * number)
                    if number == 10:
                        self.daemon.kill()
                        self.daemon.start()
                    time.sleep(0.01)
            self.assertTrue(lost.exception.__suppress_context__)
            for _ in range(60):
                try:
                    with c.scene() as scene:
                        scene.add(model).strike(POINT, IMPULSE)
                    break
                except carillon.ServerUnavailable:
                    time.sleep(1)
            else:
                self.fail("the client has not connected again")

    def test_a_proxy_for_the_network_is_not_asked_for_this_machine(self):
        self.serve("--listen", "127.0.0.1:0")
        address = self.daemon.listening[1].split()[-1]
        said = run_script(f"""
import asyncio, carillon
async def ask():
    async with carillon.aio.connect({address!r}) as c:
        return await c.info()
print(carillon.connect({address!r}).info().version, asyncio.run(ask()).version)
""", http_proxy="http://127.0.0.1:1", no_proxy="")
        self.assertEqual(said, [carillon.__version__] * 2)


class TokenTest(SecuredTest):
    def test_both_faces_show_their_token(self):
        self.serve_secured(access_line("robot", "strike,listen", "a token"))
        options = {"tls_roots": self.authority.certificate}

        def step_count(token):
            with carillon.connect(self.address, token=token, **options) as c, c.scene() as scene:
                with scene.stream(step=0.01) as stream:
                    stream.step(0.0)
                return stream.report.step_count

        async def awaited_step_count(token):
            async with carillon.aio.connect(self.address, token=token, **options) as c, await c.scene() as scene:
                async with scene.stream(step=0.01) as stream:
                    await stream.step(0.0)
                return stream.report.step_count

        for count in step_count, lambda token: asyncio.run(awaited_step_count(token)):
            self.assertEqual(count("a token"), 1)
            with self.assert_refused("TOKEN_WRONG"):
                count("another")
