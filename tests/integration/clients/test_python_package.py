# SPDX-License-Identifier: Apache-2.0
"""The Python package against the real daemon: models, strikes, streams, traces, asyncio and refusals."""

import asyncio
import types

import numpy

import carillon
import meshes
from carillon.v1 import contact_pb2
from daemon import DaemonTest, ScratchTest

BAR = meshes.box(meshes.BAR_SIZE)
POINT, IMPULSE, DURATION_S = (0.0, 0.008, 0.010), (0, 0, -0.002), 1e-4
LOWEST_HZ = meshes.bar_first_bending_hz()


class PackageTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model = cls.c.create_model(BAR, meshes.MATERIAL, label="bar")

    def struck(self, *times_s, factor=1):
        """A trace of the bar, which is struck at these times."""
        trace = carillon.Trace(1 / 60)
        bar = trace.add(self.model)
        for time_s in times_s:
            impulse = numpy.multiply(IMPULSE, factor)
            trace.step(time_s, impacts=carillon.Impacts(bar, POINT, impulse, durations=DURATION_S))
        return trace

    def assert_rings(self, heard, tolerance=0.01):
        self.assertGreater(heard.peak, 1e-4)
        self.assertAlmostEqual(heard.loudest_frequency_hz() / LOWEST_HZ, 1, delta=tolerance)


class ModelsTest(PackageTest):
    def test_frequencies_of_a_model_match_beam_theory(self):
        self.assertAlmostEqual(self.model.frequencies()[0] / LOWEST_HZ, 1, delta=0.01)
        # Twice the size rings an octave lower, but for the damping, which lowers high modes a little.
        numpy.testing.assert_allclose(2 * self.model.frequencies(size=2), self.model.frequencies(), rtol=1e-4)

    def test_a_loss_factor_of_the_caller_sets_the_decay(self):
        lossy = carillon.material(meshes.MATERIAL, loss_factor={100: 1e-3, 1e5: 1e-3}, alpha1_s=0, alpha2_per_s=0)
        frequencies, decays = self.model.modes(lossy)
        numpy.testing.assert_allclose(decays, 1e-3 * numpy.pi * frequencies, rtol=1e-5)

    def test_mode_shapes_are_mass_normalised(self):
        arrays = self.model.arrays
        self.assertEqual(arrays["shapes"].shape, (len(arrays["vertices"]), 3, self.model.mode_count))
        self.assertLess(arrays["triangles"].max(), len(arrays["vertices"]))
        # The end of a free beam moves twice the root mean square: phi^2 V = 4 for unit density.
        corner = numpy.linalg.norm(arrays["vertices"] - numpy.array(POINT), axis=1).argmin()
        end = arrays["shapes"][corner, 2, 0]**2 * numpy.prod(meshes.BAR_SIZE)
        self.assertAlmostEqual(end, 4, delta=0.1)

    def test_a_mesh_is_the_same_as_a_file_as_arrays_and_as_the_object_of_a_library(self):
        file = self.folder / "bar.obj"
        file.write_bytes(carillon.meshes.to_mesh_file(BAR).data)
        vertices, faces = map(numpy.array, BAR)
        for mesh in (file, (vertices, faces), types.SimpleNamespace(vertices=vertices, faces=faces),
                     types.SimpleNamespace(vertices=BAR[0], triangles=BAR[1])):
            self.assertEqual(self.c.create_model(mesh, meshes.MATERIAL).name, self.model.name)
        with self.assertRaisesRegex(TypeError, "int is no mesh"):
            self.c.upload(7)

    def test_models_are_found_by_label_digits_and_filter(self):
        digits = self.model.name.removeprefix("modalModels/")[:10]
        for text in ("bar", digits, self.model.name):
            self.assertEqual(self.c.model(text).name, self.model.name)
        self.assertEqual([model.name for model in self.c.models(label_contains="BA")], [self.model.name])
        self.assertEqual(list(self.c.models(tag="nothing")), [])
        for text, words in (("bell", ""), ("barr", 'did you mean "bar"')):
            with self.assert_refused("MODAL_MODEL_NOT_FOUND", words):
                self.c.model(text)

    def test_progress_is_told_to_a_function(self):
        states = []
        self.c.create_model(BAR, meshes.MATERIAL, max_frequency_hz=12000, label="again", progress_bar=states.append,
                            unit=1.01)
        fractions = [job.progress.fraction for job in states[:-1]]
        self.assertGreater(len(states), 1)
        self.assertEqual(fractions, sorted(fractions))

    def test_a_job_can_be_cancelled(self):
        job = self.c.create_job(BAR, meshes.MATERIAL, settings={"mesh": {"target_node_count": 60000}})
        job.cancel()
        with self.assert_refused("JOB_CANCELLED"):
            job.wait()
        self.assertEqual(job.refresh().state, "cancelled")

    def test_refusals_have_the_reason_of_the_contract(self):
        with self.assert_refused("MESH_NOT_CLOSED", "open edges"):
            self.c.create_model(([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]), meshes.MATERIAL)
        with self.assert_refused("UNKNOWN_MATERIAL"):
            self.c.create_model(BAR, "chime_aluminium")
        with self.assertRaises(carillon.ServerUnavailable):
            carillon.connect(f"unix:{self.folder}/nobody").status()

    def test_pictures_have_titles_units_and_frequencies(self):
        import matplotlib
        matplotlib.use("Agg")
        heard = self.model.render_strike(POINT, IMPULSE, seconds=0.5)
        frequencies = self.model.frequencies()
        for axes, unit in ((heard.plot(), "s"), (heard.plot_spectrum(), "Hz"), (self.model.plot_modes(), "Hz"),
                           (self.model.plot_shape(1), "m")):
            self.assertTrue(axes.get_title())
            self.assertTrue(axes.get_xlabel().endswith(f"/ {unit}"), axes.get_xlabel())
        shown = [float(text.get_text().split()[0]) for text in self.model.plot_modes().texts]
        self.assertTrue(all(numpy.abs(frequencies - hz).min() <= 0.051 for hz in shown))
        self.assertIn(f"{frequencies[1]:.1f} Hz", self.model.plot_shape(1).get_title())
        peaks = [float(text.get_text().split()[0]) for text in heard.plot_spectrum().texts]
        self.assertLess(abs(peaks[0] - heard.loudest_frequency_hz()), 0.1)

    def test_a_notebook_shows_models_and_plays_sounds(self):
        self.assertIn(f"<td>{self.model.name}</td>", self.model._repr_html_())
        heard = self.model.render_strike(POINT, IMPULSE, seconds=0.1)
        self.assertIn('<audio controls src="data:audio/wav;base64,UklGR', heard._repr_html_())


class SoundTest(PackageTest):
    def test_a_rendered_strike_rings_at_the_lowest_bending_mode_and_is_the_same_again(self):
        once = self.model.render_strike(POINT, IMPULSE, duration=DURATION_S, seconds=1)
        self.assert_rings(once)
        numpy.testing.assert_array_equal(
            self.model.render_strike(POINT, IMPULSE, duration=DURATION_S, seconds=1).samples, once.samples)

    def test_takes_follow_each_other_without_a_gap(self):
        with self.c.scene() as scene:
            bar = scene.add(self.model)
            with self.c.recording(scene=scene.name) as whole, self.c.recording(scene=scene.name) as pieces:
                bar.strike(POINT, IMPULSE, DURATION_S)
                taken = [pieces.take(seconds) for seconds in (0.3, 0.001, 0.2)]
                at_once = whole.take(1.0)
        joined = numpy.concatenate([piece.samples[:, 0] for piece in taken])
        self.assertEqual(len(joined), 24048)
        # The two recordings may begin at different blocks.
        first, other = (int(numpy.flatnonzero(numpy.abs(samples) > 1e-3)[0])
                        for samples in (joined, at_once.samples[:, 0]))
        numpy.testing.assert_array_equal(joined[first:], at_once.samples[other:other + len(joined) - first, 0])

    def test_a_scene_is_turned_down_muted_and_stopped(self):
        with self.c.scene(gain=0.5) as scene:
            self.assertEqual(scene.update(muted=True).gain, 0.5)
            bar = scene.add(self.model)
            with self.c.recording(scene=scene.name, block_frame_count=4800) as heard:
                bar.strike(POINT, IMPULSE, DURATION_S)
                self.assertEqual(heard.take(0.5).peak, 0)
            self.assertGreater(self.c.status().active_mode_count, 0)
            scene.update(muted=False)
            self.assertGreater(scene.listen(0.3).peak, 0)
            scene.stop()
            self.assertGreaterEqual(self.c.stop_all(), 1)

    def test_a_stream_that_is_too_fast_drops_the_oldest_steps(self):
        with self.c.scene() as scene:
            stream = scene.stream(step=0.001)
            step = contact_pb2.ContactStep(contact_columns=[contact_pb2.ContactColumns(object=[1] * 200)])
            for i in range(20000):
                step.time_s = 0.001 * i
                stream.send(contact_pb2.ContactStep.FromString(step.SerializeToString()))
            report = stream.close(warn=False)
            self.assertEqual(report.step_count + stream.dropped_step_count, 20000)
            dropped = [one.count for one in stream.warnings if one.id == "STEPS_DROPPED"]
            self.assertEqual(dropped, [stream.dropped_step_count] if stream.dropped_step_count else [])

    def test_a_stream_that_failed_raises_at_its_next_step(self):
        scene = self.c.scene()
        scene.delete()
        stream = scene.stream(step=0.01)
        with self.assert_refused("SCENE_NOT_FOUND") as refused:
            stream.close()
        self.assertTrue(refused.exception.__suppress_context__)  # gRPC's traceback is not shown

    def test_a_trace_is_written_read_and_rendered(self):
        trace = carillon.Trace(1 / 60, simulator="test")
        bar = trace.add(self.model, label="bar")
        trace.step(0.0, impacts=carillon.Impacts(bar, POINT, IMPULSE, durations=DURATION_S))
        trace.step(0.5, contacts=carillon.Contacts([bar], [POINT], [IMPULSE]))
        file = self.folder / "trace.contacts"
        trace.write(file)
        self.assertEqual(list(carillon.Trace.read(file).records()), list(trace.records()))
        heard = self.c.render(file, tail_s=1.0, channel_count=2)
        self.assertEqual(heard.samples.shape[1], 2)
        self.assert_rings(heard)


class ContactsTest(PackageTest):
    """What the columns of a step mean, by the sound of traces."""

    def rendered(self, *steps, object_count=1, poses=(), step=1 / 240, **settings):
        """The sound of steps (time, content) on `object_count` bars, of which `poses` has the poses."""
        trace = carillon.Trace(step, **settings)
        for i in range(object_count):
            trace.add(self.model, pose=poses[i] if poses else None)
        for time, content in steps:
            trace.step(time, **content)
        return self.c.render(trace, tail_s=0.3)

    def assert_same(self, one, other):
        self.assertGreater(one.peak, 1e-5)
        numpy.testing.assert_array_equal(one.samples, other.samples)

    def test_the_striker_sets_how_bright_a_strike_is(self):
        def energy_above_8_khz(**strike):
            frequencies, magnitude = self.model.render_strike(POINT, IMPULSE, seconds=0.3, **strike).spectrum()
            return numpy.square(magnitude[frequencies > 8000]).sum()
        self.assertLess(energy_above_8_khz(striker="wood"), 0.5 * energy_above_8_khz(striker="steel"))
        heavy = carillon.striker("wood", mass_kg=0.2)
        self.assertLess(energy_above_8_khz(striker=heavy), energy_above_8_khz(striker="wood"))
        # Steel is what the daemon takes where nothing is known, and NaN is a duration that is not known.
        self.assert_same(self.model.render_strike(POINT, IMPULSE, seconds=0.3, striker="steel"),
                         self.model.render_strike(POINT, IMPULSE, seconds=0.3, duration=numpy.nan))
        with self.assert_refused("UNKNOWN_STRIKER"):
            self.model.render_strike(POINT, IMPULSE, striker="marshmallow")

    def test_a_force_is_heard_by_its_roughness_and_not_by_its_end(self):
        def slid(newtons, **roughness):
            force = carillon.ContactForces(1, [POINT], [(0, 0, -newtons)], **roughness)
            return self.rendered(*[(i / 240, {"forces": force}) for i in range(24)], (24 / 240, {}))
        rough = {"travel_speeds": [1.0], "roughness_depth": 0.5, "irregularity_length": 1e-4}
        loud, quiet = slid(10, **rough), slid(5, **rough)
        self.assertGreater(loud.peak, 1e-6)
        numpy.testing.assert_allclose(loud.samples, 2 * quiet.samples, atol=1e-3 * loud.peak)
        self.assertLess(slid(10).peak, 1e-3 * loud.peak)

    def test_each_ear_hears_its_own_side_louder_and_behind_and_above_unlike_ahead(self):
        def heard(*place):
            trace = carillon.Trace(1 / 240, hearing={"binaural": True})
            trace.add(self.model, pose=place)
            trace.step(0.1, impacts=carillon.Impacts(1, [POINT], [IMPULSE], durations=DURATION_S))
            return self.c.render(trace, channel_count=2, tail_s=0.5).samples
        for x, y, z in ((1, 0, 0), (0.7, 0.2, -0.7), (1, 0, 0.3)):
            for side, near in ((-1, 0), (1, 1)):
                powers = numpy.square(heard(side * x, y, z)).mean(axis=0)
                self.assertGreater(powers[near], 2 * powers[1 - near], (side * x, y, z))  # 3 dB
        ahead, behind, above = heard(0, 0, -1), heard(0, 0, 1), heard(0, 1, 0)
        for other in (behind, above):
            self.assertGreater(numpy.abs(other - ahead).max(), 0.05 * numpy.abs(ahead).max())

    def test_warnings_tell_of_points_away_from_the_surface(self):
        far = {"contacts": carillon.Contacts(1, [(0, 0, 1)], [IMPULSE])}
        with self.assertWarns(carillon.ContactWarning) as told:
            self.assertEqual(self.rendered((0.0, far), (0.01, {})).summary.findings.blow_count, 1)
        self.assertEqual((told.warning.id, told.warning.count), ("POINTS_DISTANT", 1))
        self.assertAlmostEqual(told.warning.figures["largest_distance_m"], 0.99, delta=1e-6)
        with self.c.scene() as scene, self.assertWarns(carillon.ContactWarning):
            scene.add(self.model, handle=1)
            with scene.stream(step=1 / 240) as stream:
                stream.step(0.0, **far)
        self.assertEqual([(one.id, one.count) for one in stream.warnings], [("POINTS_DISTANT", 1)])


class AioTest(PackageTest):
    def test_a_strike_is_heard_while_the_event_loop_goes_on(self):
        async def strike():
            async with carillon.aio.connect(self.daemon.server) as c, await c.scene() as scene:
                model = await c.create_model(BAR, meshes.MATERIAL)
                bar = await scene.add(model)
                listening = asyncio.create_task(c.listen(1.5))
                turns = 0
                while not listening.done():
                    await asyncio.sleep(0.1)
                    turns += 1
                    if turns == 3:
                        await scene.strike(bar, POINT, IMPULSE, DURATION_S)
                self.assertGreater(turns, 3)
                self.assertEqual([found.name async for found in c.models(label_contains="bar")], [model.name])
                self.assertIn(scene.name, [found.name for found in await c.scenes()])
                return listening.result()

        self.assert_rings(asyncio.run(strike()))

    def test_a_cancelled_task_ends_its_call(self):
        async def cancel():
            async with carillon.aio.connect(self.daemon.server) as c:
                listening = asyncio.create_task(c.listen(3600))
                await asyncio.sleep(0.3)
                listening.cancel()
                with self.assertRaises(asyncio.CancelledError):
                    await listening

        asyncio.run(cancel())


class ValuesTest(ScratchTest):
    def test_a_pose_is_a_position_a_pair_or_a_matrix(self):
        quarter = numpy.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
        pose = carillon.contacts.to_pose(quarter)
        half = 0.5**0.5
        numpy.testing.assert_allclose([pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z],
                                      [half, 0, 0, half], atol=1e-12)
        self.assertEqual(pose.position_m, contact_pb2.Vec3(x=1, y=2, z=3))
        self.assertEqual(carillon.contacts.to_pose((1, 2, 3)), contact_pb2.Pose(position_m=pose.position_m))

    def test_columns_are_the_numbers_that_were_given(self):
        generator = numpy.random.default_rng(7)
        # Handles of each length that a varint can have, and their neighbours.
        handles = numpy.array([0, 1, *(2**bits + i for bits in (7, 14, 21, 28) for i in (-1, 0)), 2**32 - 1])
        points, impulses = generator.normal(size=(2, len(handles), 3))
        step = carillon.contacts.make_step(1, contacts=carillon.Contacts(handles, points, impulses, partners=handles),
                                           poses=carillon.Poses(handles, points))
        columns = step.contact_columns[0]
        self.assertEqual(list(columns.object), handles.tolist())
        self.assertEqual(list(columns.partner), handles.tolist())
        self.assertEqual(list(columns.point_m), points.astype("f4").ravel().tolist())
        self.assertEqual(list(columns.impulse_newton_seconds), impulses.astype("f4").ravel().tolist())
        self.assertEqual(list(step.poses.position_m), points.ravel().tolist())

    def test_damaged_and_newer_traces_are_refused(self):
        trace = carillon.Trace(1 / 60)
        trace.step(0.5)
        file = self.folder / "damaged.contacts"
        trace.write(file)
        whole = file.read_bytes()
        header = bytes([4, 0x0A, 2, 8, 1])
        newer = bytes([4, 0x0A, 2, 8, 9])
        unknown_kind = bytes([3, 0x7A, 1, 0])
        for data, reason in ((whole[:-3], "TRACE_MALFORMED"), (b"", "TRACE_MALFORMED"), (newer, "TRACE_TOO_NEW"),
                             (bytes([2, 0x0A, 0]), "TRACE_MALFORMED"), (header + unknown_kind, "TRACE_MALFORMED"),
                             (b"\xff" * 9 + b"\x01", "TRACE_MALFORMED"), (b"\xff" * 100, "TRACE_MALFORMED")):
            file.write_bytes(data)
            with self.subTest(data=data[:20]), self.assert_refused(reason):
                carillon.Trace.read(file)
