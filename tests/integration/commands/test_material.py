# SPDX-License-Identifier: Apache-2.0
"""`carillon material fit` and carillon.fit: the material of a plate is found from the sound that the daemon itself
renders of it, with its residual and its picture."""

import matplotlib
import numpy

import carillon
import meshes
from daemon import BIN, DaemonTest

matplotlib.use("Agg")
SIDES_M = (0.12, 0.08, 0.008)
YOUNG_PA, POISSON, DENSITY, LOSS = 71e9, 0.31, 2600, 1e-3
PLACES = ("0.11,0.07,0.008", "0.02,0.051,0.008", "0.067,0.012,0.008")


class Material(DaemonTest):

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        mesh = cls.folder / "plate.obj"
        mesh.write_bytes(meshes.obj(*meshes.box(SIDES_M)))
        figures = ("--young", YOUNG_PA, "--density", DENSITY, "--loss-factor", LOSS)
        options = (mesh, "--wait", "--without-transfer", "--band", "20:15000", *figures)
        # A real plate has no mesh, and the fit takes the errors of the model's mesh off: this one's must be small.
        cls.daemon.command("model", "create", *options, "--label", "true", "--poisson", POISSON, "--accuracy", "0.5%")
        cls.taps = [cls.folder / f"tap{number}.wav" for number in range(len(PLACES))]
        for tap, place in zip(cls.taps, PLACES):
            cls.daemon.command("strike", "true", "--point", place, "--impulse", "0,0,-0.002", "--duration", 5e-5,
                               "--seconds", 1.5, "--normalize", "--out", tap)
        # The fit knows the body by a model of another Poisson's ratio.
        cls.daemon.command("model", "create", *options, "--label", "plate", "--poisson", 0.28)
        cls.own = {"program": str(BIN / "carillon"), "server": cls.daemon.server}
        cls.found = carillon.fit.material("plate", cls.taps, density=DENSITY, **cls.own)

    def assert_found(self, found):
        self.assertLess(abs(found.young_pa / YOUNG_PA - 1), 0.01)  # twice the accuracy of what was heard
        self.assertLess(abs(found.poisson_ratio - POISSON), 0.02)
        self.assertGreaterEqual(found.matched, 6)

    def test_fit_finds_material_damping_and_residual(self):
        self.assert_found(self.found)
        self.assertAlmostEqual(self.found.material.young_pa / self.found.young_pa, 1, delta=1e-5)
        rates = [line.law_per_s / (LOSS * numpy.pi * line.frequency_hz) for line in self.found.lines if line.mode]
        self.assertLess(abs(numpy.median(rates) - 1), 0.1)
        self.assertTrue(0 < self.found.damping_error < 0.2, self.found.damping_error)
        self.assertIn("(two standard errors)", self.found.text)
        # From 20 to 100 ms there is nothing but the modes, of which those that no line was found for are the rest.
        late = [share for begin, end, share in self.found.residual_shares if begin == 0.02]
        self.assertLess(late[0], 0.05)
        self.assertGreater(self.found.residual.seconds, 1)
        self.assertEqual(carillon.fit.extract(self.taps, program=self.own["program"]).strike_count, len(PLACES))

    def test_a_wrong_sample_rate_is_cautioned_against(self):
        # No glass has the plate's ratio.
        self.assertEqual(self.found.nearest_material, "soda_lime_glass")
        self.assertEqual(["proportions" in caution for caution in self.found.cautions], [True])
        taps = [self.folder / f"fast{number}.wav" for number in range(len(self.taps))]
        for tap, fast in zip(self.taps, taps):
            sound = carillon.Sound.load(tap)
            carillon.Sound(sound.samples, round(sound.sample_rate_hz * 1.088)).save(fast)
        found = carillon.fit.material("plate", taps, density=DENSITY, **self.own)
        self.assertAlmostEqual(found.young_pa / self.found.young_pa, 1.088**2, delta=0.01)
        self.assertEqual(len(found.cautions), 2)
        self.assertIn("sample rate", found.cautions[0])
        self.assertIn("proportions", found.cautions[1])
        self.assertIn(found.cautions[0], found.text)

    def test_changed_recordings_are_cautioned_against(self):
        rate_hz, rng = 48000, numpy.random.default_rng(4)
        found = {name: [] for name in ("noisy", "gated", "clipped")}
        for number, tap in enumerate(self.taps):
            samples = numpy.concatenate([numpy.zeros((rate_hz // 2, 1)), carillon.Sound.load(tap).samples[:, :1]])
            samples += 2e-4 * rng.standard_normal(samples.shape)
            quiet = samples.copy()
            quiet[rate_hz // 2 + rate_hz:] = 0
            for name, changed in zip(found, (samples, quiet, numpy.clip(8 * samples, -0.99, 0.99))):
                found[name].append(self.folder / f"{name}{number}.wav")
                carillon.Sound(changed.astype(numpy.float32), rate_hz).save(found[name][-1])
        plain, gated, clipped = (carillon.fit.extract(taps, program=self.own["program"]) for taps in found.values())
        self.assertEqual((plain.gain_fall_db, plain.clipped_s), (0, 0))
        self.assertGreater(gated.gain_fall_db, 30)
        self.assertGreater(clipped.clipped_s, 0.01)

    def test_a_named_material_needs_no_caution(self):
        mesh, table = self.folder / "bar.obj", self.folder / "bar.csv"
        mesh.write_bytes(meshes.obj(*meshes.box((0.25, 0.032, 0.008))))
        bar = self.c.create_model(mesh, material="brass", without_transfer=True)
        table.write_text("".join(f"{hz}\n" for hz in bar.frequencies()[:12]))
        found = carillon.fit.material(bar.name, table, density=8500, **self.own)
        self.assertAlmostEqual(found.poisson_ratio, 0.35, delta=0.03)
        self.assertEqual((found.nearest_material, found.cautions), ("brass", []))

    def test_the_material_file_makes_a_model_that_sounds_as_recorded(self):
        again = self.c.create_model(self.folder / "plate.obj", material=self.found.material, label="again",
                                    max_frequency_hz=9000, accuracy=0.005)
        least = min(again.mode_count, 6)
        ratio = again.frequencies()[:least] / self.c.model("true").frequencies()[:least]
        self.assertLess(abs(ratio - 1).max(), 0.005)

    def test_the_picture_has_each_line_and_mode_once(self):
        spectrum, decays = self.found.plot()
        drawn = {line.get_label(): line.get_xdata() for line in spectrum.lines}
        matched = [line.frequency_hz for line in self.found.lines if line.mode]
        label = [name for name in drawn if "from their modes" in name][0]
        numpy.testing.assert_allclose(sorted(drawn[label]), sorted(matched))
        self.assertIn("GPa", spectrum.get_title())
        self.assertTrue(decays.get_xlabel().endswith("/ Hz"))

    def test_a_table_of_frequencies_is_enough_and_a_noise_is_refused(self):
        table = self.folder / "lines.csv"
        table.write_text("frequency_hz\n" + "".join(f"{line.frequency_hz}\n" for line in self.found.lines))
        self.assert_found(carillon.fit.material("plate", [table], density=DENSITY, **self.own))
        table.write_text("\ufefffrequency_hz,t60_s\n" + "".join(
            f"{line.frequency_hz},{numpy.log(1000) / line.decay_per_s}\n" for line in self.found.lines))
        found = carillon.fit.material("plate", table, density=DENSITY, damping="eta", **self.own)
        self.assertAlmostEqual(found.laws[0]["loss_factor"][0]["loss_factor"] / LOSS, 1, delta=0.1)
        for text in ("468,4\n1284,5\n", "468,4;10\n", "frequency_hz,t60\n468,10\n", "468.4;10\n"):
            table.write_text(text)
            with self.subTest(text), self.assert_refused("RECORDING_UNREADABLE"):
                carillon.fit.material("plate", table, density=DENSITY, **self.own)
        noise = numpy.random.default_rng(1).standard_normal((48000, 1)).astype(numpy.float32) * 0.1
        carillon.Sound(noise, 48000).save(self.folder / "noise.wav")
        with self.assertRaises(carillon.CarillonError) as refused:
            carillon.fit.material("plate", [self.folder / "noise.wav"], density=DENSITY, **self.own)
        self.assertIn(refused.exception.reason, ("TOO_FEW_MODES", "RECORDING_TOO_NOISY"))
