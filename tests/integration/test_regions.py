# SPDX-License-Identifier: Apache-2.0
"""A mallet of two materials from a file with sections, through the daemon to sound: pitch and decay of each partial,
scaling by common factors, and clear refusals."""

import math

import meshes
import numpy
import sound
from daemon import DaemonTest

import carillon

LENGTH = meshes.BAR_SIZE[0]
CELLS = (10, 2, 1)
JOINT = 0.6 * LENGTH
BRASS_ETA, OAK_ETA = 0.0005, 0.01  # of the catalogue


def sections():
    """The bar of the other tests, its first three fifths in the section BRASS and the rest in GRIP, of MY-OAK."""
    nodes, tetrahedra = meshes.tetrahedra_of_bar(*CELLS)
    lines = ["*NODE"] + [f"{n + 1}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(nodes)]
    for name, wanted in (("brass", True), ("grip", False)):
        lines.append(f"*ELEMENT, TYPE=C3D4, ELSET={name}")
        lines += [f"{e + 1}, " + ", ".join(str(n + 1) for n in tetrahedron) for e, tetrahedron in enumerate(tetrahedra)
                  if (sum(nodes[n][0] for n in tetrahedron) / 4 < JOINT) == wanted]
    lines += ["*SOLID SECTION, ELSET=BRASS, MATERIAL=CuZn", "*SOLID SECTION, ELSET=GRIP, MATERIAL=My-Oak"]
    return "\n".join(lines) + "\n"


class RegionsTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.mallet = cls.folder / "mallet.inp"
        cls.mallet.write_text(sections())

    def create(self, *materials):
        """The name of the mallet's model."""
        options = [part for text in materials for part in ("--material", text)]
        return self.daemon.command("model", "create", self.mallet, *options, "--band", "20:8000",
                                   "--wait").stdout.strip()

    def modes(self, model):
        shown = self.daemon.json("model", "show", model)
        return shown["frequencies_hz"], shown["t60_s"], shown["header"]

    def struck(self, model, seconds):
        """The sound of a blow at the end of the body, as the command writes it."""
        out = self.folder / "struck.wav"
        self.daemon.command("strike", model, "--out", out, "--point", f"0,0.003,{meshes.BAR_SIZE[2]}", "--impulse",
                            "0.002,-0.003,-0.005", "--duration", 0, "--seconds", seconds)
        return sound.read_wave(out)[:, 0]

    def test_each_partial_has_its_pitch_and_the_decay_of_its_strain_energy(self):
        model = self.create("brass=brass", "my-oak=oak")
        frequencies_hz, t60_s, header = self.modes(model)
        regions = {region["properties"]["region"]: region for region in header["regions"]}
        self.assertEqual(set(regions), {"brass", "my-oak"})
        for k, hz in enumerate(frequencies_hz):
            strain = [regions[name]["strain_energy_parts"][k] for name in ("brass", "my-oak")]
            self.assertAlmostEqual(sum(strain), 1, places=6)
            eta = strain[0] * BRASS_ETA + strain[1] * OAK_ETA
            self.assertAlmostEqual(t60_s[k] * eta * math.pi * hz, math.log(1000), delta=1e-4)
        samples = self.struck(model, 2)
        self.assertGreaterEqual(len(frequencies_hz), 4)
        for k, hz in enumerate(frequencies_hz[:4]):
            rate = math.log(1000) / t60_s[k]
            partial = sound.measure(samples, hz, 0.06, min(0.06 + 4 / rate, 1.5), 0.01)
            damped_hz = math.sqrt(hz**2 - (rate / (2 * math.pi))**2)
            self.assertAlmostEqual(partial.frequency_hz / damped_hz, 1, delta=1e-5)
            self.assertAlmostEqual(partial.decay_per_s / -rate, 1, delta=0.01)
        # Neither of the two materials alone decays like that.
        alone = [math.log(1000) / (eta * math.pi * frequencies_hz[0]) for eta in (OAK_ETA, BRASS_ETA)]
        self.assertTrue(1.2 * alone[0] < t60_s[0] < alone[1] / 1.2)

    def test_a_stored_model_serves_common_factors_only(self):
        model = self.create("brass=brass", "grip=oak")
        before, _, _ = self.modes(model)

        def scaled(brass, oak):
            of = {"brass": carillon.material("brass", young_pa=brass * 100.6e9),
                  "grip": carillon.material("oak", young_pa=oak * 12.3e9)}
            with self.c.scene() as scene:
                told = scene.add(model, of).message
                # A material that the daemon told may be given back.
                self.assertEqual(scene.add(model, told.material).message.lowest_frequency_hz, told.lowest_frequency_hz)
                return told.lowest_frequency_hz

        self.assertAlmostEqual(scaled(4, 4) / scaled(1, 1), 2, places=6)
        with self.assert_refused("REGION_MATERIAL_DIFFERS"):
            scaled(1, 1.1)
        shown, decays = self.c.model(model).modes({"BRASS": "brass", "grip": "oak"})
        numpy.testing.assert_allclose(numpy.hypot(shown, decays / (2 * numpy.pi)), before, rtol=1e-9)

    def test_boxes_that_touch_are_the_same_body(self):
        """The grip is thinner than the head, so that its end lies on a part of the head's face."""
        _, width, height = meshes.BAR_SIZE
        head = meshes.box((JOINT, width, height))
        grip = meshes.box((LENGTH - JOINT, width / 2, height / 2), (JOINT, width / 4, height / 4))
        surface = self.folder / "parts.obj"
        lines, count = [], 0
        for name, (vertices, faces) in (("head", head), ("grip", grip)):
            lines += [f"o {name}", *(f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices)]
            lines += ["f " + " ".join(str(count + v + 1) for v in face) for face in faces]
            count += len(vertices)
        surface.write_text("\n".join(lines) + "\n")
        create = ("model", "create", surface, "--nodes", 600, "--band", "20:8000", "--wait", "--material")
        model = self.daemon.command(*create, "head=brass", "--material", "grip=oak").stdout.strip()
        frequencies_hz, _, header = self.modes(model)
        mass_kg = header["mass_moments"][0] * 750  # the grip, of oak, is the reference
        self.assertAlmostEqual(mass_kg / (JOINT * width * height * 8500
                                          + (LENGTH - JOINT) * width * height / 4 * 750), 1, delta=1e-6)
        self.assertGreater(len(frequencies_hz), 5)
        partial = sound.measure(self.struck(model, 1), frequencies_hz[0], 0.06, 0.2, 0.01)
        self.assertAlmostEqual(partial.frequency_hz / frequencies_hz[0], 1, delta=1e-4)
        self.assertEqual(self.daemon.refusal(*create, "head=brass"), "MESH_REGION_UNKNOWN")

    def test_materials_and_regions_must_match(self):
        for reason, *materials in (("MESH_REGION_UNKNOWN", "brass=brass"),
                                   ("MESH_REGION_UNKNOWN", "brass=brass", "grip=oak", "head=lead"),
                                   ("MESH_ELEMENT_UNSUPPORTED", "oak"), ("UNKNOWN_MATERIAL", "brass=bras", "grip=oak")):
            with self.subTest(materials=materials):
                options = [part for text in materials for part in ("--material", text)]
                self.assertEqual(self.daemon.refusal("model", "create", self.mallet, "--band", "20:8000", "--wait",
                                                     *options), reason)
        self.assertEqual(self.daemon.refusal("strike", self.create("brass=brass", "grip=oak"), "--material", "oak",
                                             "--point", "0,0,0", "--impulse", "0,0,-1"), "REGION_MATERIAL_DIFFERS")

    def test_other_regions_have_the_material_without_a_name(self):
        both = self.modes(self.create("brass=brass", "grip=oak"))
        rest = self.modes(self.create("oak", "brass=brass"))
        numpy.testing.assert_allclose(rest[0], both[0], rtol=1e-9)
