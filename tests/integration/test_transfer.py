# SPDX-License-Identifier: Apache-2.0
"""The radiation of the modes is computed after the model, through a kill, and what sounds takes it over."""

import math

import numpy
from scipy import special

import carillon
import meshes
import scripted
import sound
from carillon.v1 import decomposition_pb2, decomposition_service_pb2, radiation_pb2, scene_service_pb2
from daemon import Daemon, ScratchTest, wait_until

AIR_DENSITY, SOUND_SPEED = 1.204, 343
# The paper's coupling becomes a pressure by rho omega / (4 pi r) at 1 kHz and 1 m.
PASCALS_PER_COUPLING = AIR_DENSITY * 2000 * math.pi / (4 * math.pi)
# A gain that keeps quiet modes far above the end of a rendering, and the bar below the limiter.
LOUD = 20


def real_harmonic(order, m, direction):
    """Y_lm of transfer.proto."""
    x, y, z = direction
    turn = complex(x, y) ** abs(m)
    legendre = numpy.polynomial.legendre.Legendre.basis(order).deriv(abs(m))(z)
    scale = math.sqrt((2 * order + 1) / (4 * math.pi) * math.factorial(order - abs(m)) / math.factorial(order + abs(m)))
    return scale * legendre * (1 if m == 0 else math.sqrt(2) * (turn.real if m > 0 else turn.imag))


def relative_pressure(arrays, mode, kr, direction):
    """|sum of c_lm h_l Y_lm|, relative to the same power radiated equally in all directions."""
    kept = range(arrays["first"][mode], arrays["first"][mode + 1])
    pairs = arrays["coefficients"]
    total, squares = 0, 0
    for i in kept:
        order = math.isqrt(int(arrays["harmonics"][i]))
        m = int(arrays["harmonics"][i]) - order * order - order
        hankel = special.spherical_jn(order, kr) + 1j * special.spherical_yn(order, kr)
        total += complex(*pairs[i]) * hankel * real_harmonic(order, m, direction)
        squares += pairs[i] @ pairs[i]
    return abs(total) * kr * math.sqrt(4 * math.pi / squares)


class TransferTest(ScratchTest):
    def setUp(self):
        super().setUp()
        self.serve("--transfers", "--precompute", scripted.worker(self.folder, scripted.TRANSFERS_WAIT))

    def transfer_job(self):
        """The job that computes a transfer, as it stands now."""
        jobs = self.client.jobs.ListJobs(decomposition_service_pb2.ListJobsRequest()).jobs
        found = [job for job in jobs if job.kind == decomposition_pb2.JOB_KIND_TRANSFER]
        self.assertEqual(len(found), 1)
        return found[0]

    def await_transfer(self):
        """Returns the job of the transfer when it has ended."""
        request = decomposition_service_pb2.WatchJobRequest(name=self.transfer_job().name)
        *_, last = self.client.jobs.WatchJob(request)
        return last.job

    def assert_shows_both_decays(self, shown):
        """The table of `carillon model show` has decays by material and radiation, and the T60 of their sum."""
        header, *rows = shown[shown.index(" mode  "):].splitlines()
        self.assertEqual(header.split()[-6:], ["material", "1/s", "radiation", "1/s", "T60", "s"])
        for row in rows:
            *_, material, radiation, t60 = map(float, row.split())
            self.assertGreater(material, 0)
            self.assertGreaterEqual(radiation, 0)
            self.assertAlmostEqual(t60, math.log(1000) / (material + radiation), delta=6e-4 + 2e-3 * t60)

    def add_object(self, model):
        """The name of an object in a scene of its own, and how it radiates."""
        _, added = self.client.scene(model)
        return added.name, added.radiation

    def render(self, model, radiation=None, gain=1, **hearing):
        """The bar struck across its broad side at an end."""
        trace = carillon.Trace(**hearing)
        bar = trace.add(model, meshes.MATERIAL, radiation=radiation, gain=gain)
        trace.step(0, impacts=carillon.Impacts(bar, [meshes.BAR_SIZE], [(0, 0.3e-3, -1e-3)], durations=0))
        with carillon.connect(self.daemon.server) as c:
            return c.render(trace, sample_rate_hz=sound.RATE, tail_s=0.5).samples[:, 0]

    def arrays(self, model):
        """The numbers of the model and of its transfer by name, out of an exported file, and the transfer's centre."""
        file = self.folder / "exported.model"
        self.daemon.command("model", "export", model, "--out", file)
        header, arrays = scripted.read_transfer(file)
        center = header.center_m
        return {**scripted.read_model(file)[1], **arrays, "center_m": numpy.array([center.x, center.y, center.z])}

    def test_levels_and_decays_change_as_the_transfer_says_through_a_kill(self):
        model = self.client.model(max_frequency_hz=8000)
        self.assertEqual(self.transfer_job().modal_model, model)
        name, radiation = self.add_object(model)
        self.assertEqual(radiation, radiation_pb2.RADIATION_MODEL_PAPER_COUPLING)
        before = self.render(model)

        wait_until((self.folder / "runs").exists)  # the job's process may only just have been started
        self.daemon.kill()
        self.daemon.start()
        self.client = self.daemon.client()
        name, radiation = self.add_object(model)
        self.assertEqual(radiation, radiation_pb2.RADIATION_MODEL_PAPER_COUPLING)
        (self.folder / "enough").touch()
        self.assertEqual(self.await_transfer().state, decomposition_pb2.JOB_STATE_SUCCEEDED)
        taken_over = self.client.scenes.UpdateObject(scene_service_pb2.UpdateObjectRequest(name=name)).object
        self.assertEqual(taken_over.radiation, radiation_pb2.RADIATION_MODEL_RADIATED_POWER)
        shown = self.daemon.command("model", "show", model).stdout
        self.assertIn("speed of sound near 503", shown)
        self.assert_shows_both_decays(shown)

        self.assert_changed_by(self.arrays(model), before, self.render(model))
        numpy.testing.assert_array_equal(self.render(model, "paper_coupling"), before)

        self.daemon.stop()
        self.daemon.start()
        self.client = self.daemon.client()
        self.assertEqual(self.add_object(model)[1], radiation_pb2.RADIATION_MODEL_RADIATED_POWER)
        self.assertEqual((self.folder / "runs").read_text().split(), ["transfer"] * 2)

    def test_a_performance_says_that_a_transfer_is_missing_and_sounds_alike_after_each_reset(self):
        model = self.client.model(max_frequency_hz=8000)

        def heard(performance):
            performance.reset()
            blow = carillon.Impacts(1, [meshes.BAR_SIZE], [(0, 0.3e-3, -1e-3)], durations=0)
            return performance.step(impacts=blow)[0]

        with carillon.connect(self.daemon.server) as c:
            with c.perform(step=0.1, microphones=[carillon.Omni()] * 2) as performance:
                performance.add(model, meshes.MATERIAL)
                with self.assertWarns(carillon.TransferWarning):
                    before = heard(performance)
                (self.folder / "enough").touch()
                self.await_transfer()
                numpy.testing.assert_array_equal(heard(performance), before)
            with c.perform(step=0.1, microphones=[carillon.Omni()] * 2) as performance:
                performance.add(model, meshes.MATERIAL)
                after = heard(performance)
        numpy.testing.assert_array_equal(after[0, 0], after[0, 1])
        self.assertGreater(abs(after - before).max(), 0.01 * abs(before).max())

    def assert_changed_by(self, arrays, before, after):
        changes_db = []
        for m in range(3):
            omega2 = arrays["eigenvalues"][m] * meshes.YOUNG_PA / meshes.DENSITY
            integral = arrays["power_integrals"][m] / meshes.DENSITY
            coupling = arrays["couplings"][m] * math.sqrt(meshes.YOUNG_PA) / meshes.DENSITY
            ratio = AIR_DENSITY * omega2 * math.sqrt(integral / (4 * math.pi)) / (PASCALS_PER_COUPLING * coupling)
            frequency = math.sqrt(omega2) / (2 * math.pi)
            old, new = (sound.measure(samples, frequency, 0.1, 0.4) for samples in (before, after))
            changes_db.append(20 * math.log10(ratio))
            self.assertAlmostEqual(20 * math.log10(new.amplitude / old.amplitude), changes_db[-1], delta=0.1)
            decay = AIR_DENSITY * omega2 * integral / (2 * SOUND_SPEED)
            self.assertAlmostEqual(old.decay_per_s - new.decay_per_s, decay, delta=0.05)
        # The lowest bending mode of so slender a bar hardly radiates.
        self.assertLess(changes_db[0], changes_db[2])

    def assert_heard_from_each_direction_as_the_sound_field_is(self, model):
        arrays = self.arrays(model)
        everywhere = self.render(model, "radiated_power", LOUD)
        for distance_m in (0.15, 30):
            for theta, phi in ((0.4, 0.2), (1.1, 1.4), (2.5, -2.0)):
                direction = numpy.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi),
                                         math.cos(theta)])
                heard = self.render(model, "radiated_power", LOUD, hearing={"directivity": True, "near_field": True},
                                    listener=arrays["center_m"] + distance_m * direction)
                for m in range(3):
                    self.assert_heard(arrays, m, distance_m, direction, heard, everywhere)

    def assert_heard(self, arrays, m, distance_m, direction, heard, everywhere):
        omega = math.sqrt(arrays["eigenvalues"][m] * meshes.YOUNG_PA / meshes.DENSITY)
        gain = relative_pressure(arrays, m, omega / SOUND_SPEED * distance_m, direction)
        old, new = (sound.measure(samples, omega / (2 * math.pi), 0.1, 0.4) for samples in (everywhere, heard))
        if gain > 0.1:  # louder modes beside it drown a softer one
            self.assertAlmostEqual(20 * math.log10(new.amplitude / old.amplitude), 20 * math.log10(gain), delta=0.1,
                                   msg=f"mode {m} at {distance_m} m, {direction}")

    def test_directions_are_heard_and_an_export_brings_the_transfer_to_another_daemon(self):
        (self.folder / "enough").touch()
        model = self.client.model(max_frequency_hz=8000)
        self.await_transfer()
        self.assert_heard_from_each_direction_as_the_sound_field_is(model)
        self.daemon.command("model", "export", model, "--out", self.folder / "bar.model")
        other_folder = self.folder / "other"
        other_folder.mkdir()
        other = Daemon(other_folder)
        self.addCleanup(other.stop)
        imported = other.command("model", "import", self.folder / "bar.model").stdout.strip()
        self.assertIn("transfer   for", other.command("model", "show", imported).stdout)
        self.client = other.client()
        self.assertEqual(self.add_object(imported)[1], radiation_pb2.RADIATION_MODEL_RADIATED_POWER)
