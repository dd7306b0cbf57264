# SPDX-License-Identifier: Apache-2.0
"""Modal models leave and enter as glTF and NumPy files, and sound as those say."""

import json
import math
import re
import subprocess

import jsonschema
import numpy

import carillon
import gltf
import meshes
import scripted
import sound
from daemon import DaemonTest

FLOAT = 1.2e-7  # the spacing of single precision: what is stored in it is half of that off
# Names, types and dimensions that client_sdk/interchange/README.md promises.
ARRAYS = {
    "eigenvalues": ("f8", "m"), "residuals": ("f8", "m"), "couplings": ("f8", "m"),
    "vertices": ("f4", "V3"), "triangles": ("u4", "T3"), "given_triangle": ("u4", "T"),
    "given_vertices": ("f4", "G3"), "given_triangles": ("u4", "H3"), "shapes": ("f4", "V3m")}


class InterchangeTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model_file = scripted.make_model(cls.folder)
        cls.name = cls.daemon.command("model", "import", cls.model_file, "--label", "bar").stdout.strip()
        cls.bar = cls.exported(cls.name, "bar.npz")

    @classmethod
    def exported(cls, model, name, *options):
        """The arrays of a model by way of a file."""
        path = cls.folder / name
        cls.daemon.command("model", "export", model, "--out", path, *options)
        return numpy.load(path) if name.endswith(".npz") else path

    def imported(self, path, *options):
        """(name of the model, what was said on stderr)."""
        done = self.daemon.command("model", "import", path, *options)
        return done.stdout.strip(), done.stderr

    def heard(self, model, material, seconds):
        """What one blow on the bar sounds like."""
        return self.c.model(model).render_strike((0.006, 0.0013, 0.010), (0.0, 0.002, -0.005), material, duration=0,
                                                 seconds=seconds).samples[:, 0]

    def test_numpy_loads_every_array_as_documented(self):
        sizes = {"3": 3}
        self.assertEqual(set(self.bar), set(ARRAYS) | {"header"})
        for name, (kind, dimensions) in ARRAYS.items():
            self.assertEqual(self.bar[name].dtype, numpy.dtype("<" + kind), name)
            for dimension, size in zip(dimensions, self.bar[name].shape, strict=True):
                self.assertEqual(sizes.setdefault(dimension, size), size, name)
        header = json.loads(self.bar["header"].item())
        self.assertEqual(header["mode_count"], sizes["m"])
        # Unit material: the lowest mode is where beam theory has it with this one's.
        lowest = math.sqrt(self.bar["eigenvalues"][0] * meshes.YOUNG_PA / meshes.DENSITY) / (2 * math.pi)
        self.assertLess(abs(lowest / meshes.bar_first_bending_hz() - 1), 0.02)

    def test_what_numpy_saves_is_imported(self):
        path = self.folder / "saved.npz"
        numpy.savez_compressed(
            path, eigenvalues=self.bar["eigenvalues"][:5], poisson_ratio=0.33,
            vertices=numpy.asfortranarray(self.bar["vertices"], dtype=float),
            triangles=self.bar["triangles"].astype(int), shapes=self.bar["shapes"][:, :, :5])
        name, _ = self.imported(path, "--label", "saved")
        back = self.exported(name, "saved_back.npz")
        for array in ("vertices", "triangles"):
            numpy.testing.assert_array_equal(back[array], self.bar[array])
        # The stored shapes are rounded, the couplings were made of the exact ones.
        numpy.testing.assert_allclose(back["couplings"], self.bar["couplings"][:5], rtol=1e-5)

    def test_a_gltf_keeps_the_rules_of_the_draft(self):
        for name in ("rules.glb", "rules.gltf"):
            path = self.exported(self.name, name, "--material", meshes.MATERIAL)
            document, buffer = gltf.read(path)
            jsonschema.validate(document, gltf.SCHEMA)
            model = document["extensions"][gltf.EXTENSION]["modalModels"][0]
            kinds = {"frequencies": ("SCALAR", 5126), "decayRates": ("SCALAR", 5126),
                     "positions": ("VEC3", 5126), "shapes": ("VEC3", 5126), "indices": ("SCALAR", 5125)}
            for key, kind in kinds.items():
                accessor = document["accessors"][model[key]]
                self.assertEqual((accessor["type"], accessor["componentType"]), kind, key)
            modes, points = len(self.bar["eigenvalues"]), len(self.bar["vertices"])
            arrays = {key: gltf.array(document, buffer, model[key]) for key in kinds}
            self.assertEqual([len(arrays[key]) for key in ("frequencies", "decayRates", "positions", "shapes")],
                             [modes, modes, points, modes * points])
            self.assertGreater(arrays["frequencies"].min(), 0)
            self.assertGreaterEqual(arrays["decayRates"].min(), 0)
            self.assertLess(arrays["indices"].max(), points)
            for view in document["bufferViews"]:
                self.assertLessEqual(view["byteOffset"] + view["byteLength"], document["buffers"][0]["byteLength"])

    def test_a_gltf_has_damped_frequencies_decay_rates_and_mass_normalised_shapes(self):
        figures = ("--alpha1", 3e-7, "--alpha2", 25)
        path = self.exported(self.name, "figures.glb", "--material", meshes.MATERIAL, *figures)
        document, buffer = gltf.read(path)
        extension = document["extensions"][gltf.EXTENSION]
        self.assertEqual((extension["acousticMaterials"][0]["alpha"],
                          extension["acousticMaterials"][0]["beta"]), (25, 3e-7))
        arrays = {key: gltf.array(document, buffer, extension["modalModels"][0][key])
                  for key in ("frequencies", "decayRates", "positions", "shapes")}
        omega2 = self.bar["eigenvalues"] * meshes.YOUNG_PA / meshes.DENSITY
        decay = (3e-7 * omega2 + 25) / 2
        order = numpy.argsort(arrays["frequencies"])
        numpy.testing.assert_allclose(arrays["frequencies"][order],
                                      numpy.sqrt(omega2 - decay**2) / (2 * math.pi), rtol=FLOAT)
        numpy.testing.assert_allclose(arrays["decayRates"][order], decay, rtol=FLOAT)
        numpy.testing.assert_array_equal(arrays["positions"], self.bar["vertices"])
        shapes = arrays["shapes"].reshape(len(order), -1, 3)[order]
        expected = self.bar["shapes"].transpose(2, 0, 1) / math.sqrt(meshes.DENSITY)
        numpy.testing.assert_allclose(shapes, expected, rtol=FLOAT)
        # What is heard most comes first: whoever renders one mode hears the pitch of the bar.
        heard = self.bar["couplings"] * numpy.sqrt((expected**2).sum((1, 2)) / omega2)
        self.assertEqual(order.tolist().index(0), int(numpy.argmax(heard)))

    def test_the_mesh_of_a_gltf_opens_elsewhere(self):
        for name in ("mesh.glb", "mesh.gltf"):
            path = self.exported(self.name, name, "--material", meshes.MATERIAL)
            said = subprocess.run(["assimp", "info", path], capture_output=True, text=True, check=True).stdout
            self.assertRegex(said, r"Faces: +12\n")
            self.assertRegex(said, r"Maximum point +\(0\.2000*\d? 0\.0160*\d? 0\.0100*\d?\)")

    def test_an_imported_model_has_the_material_of_the_gltf_or_of_the_command(self):
        path = self.exported(self.name, "kept.glb", "--material", meshes.MATERIAL)
        model, _ = self.imported(path)
        kept = self.daemon.json("model", "show", model)["material"]
        self.assertAlmostEqual(kept["young_pa"] / meshes.YOUNG_PA, 1, places=6)
        self.exported(model, "told.npz")
        self.daemon.command("model", "delete", model)
        model, _ = self.imported(self.folder / "told.npz", "--material", meshes.MATERIAL)
        told = self.daemon.json("model", "show", model)["material"]
        self.assertEqual(told["preset"], meshes.MATERIAL)

    # A body from elsewhere: two modes of its own figures, on the surface of the bar. The lower dies
    # sooner, which no damping by stiffness and mass does.
    FREQUENCIES_HZ = (1100.0, 440.0)
    DECAYS_PER_S = (6.0, 9.0)

    def foreign(self):
        """A document that another program might write."""
        vertices, triangles = self.bar["vertices"], self.bar["triangles"].astype(numpy.uint16)
        writer = gltf.Writer()
        along = vertices[:, 0] / vertices[:, 0].max()
        shapes = numpy.zeros((2, len(vertices), 3), numpy.float32)
        shapes[0, :, 2] = 8 * numpy.cos(2 * math.pi * along)
        shapes[1, :, 2] = 8 * numpy.cos(math.pi * along)
        model = {"name": "from elsewhere", "material": 0,
                 "frequencies": writer.add(numpy.array(self.FREQUENCIES_HZ)),
                 "decayRates": writer.add(numpy.array(self.DECAYS_PER_S)),
                 "positions": writer.add(vertices), "shapes": writer.add(shapes.reshape(-1, 3)),
                 "indices": writer.add(triangles.reshape(-1))}
        mesh = {"attributes": {"POSITION": writer.add(vertices)}, "indices": writer.add(triangles.reshape(-1))}
        material = {"density": 2500, "youngsModulus": 7e10, "poissonRatio": 0.22}
        return writer.document(model, [material], mesh)

    def test_a_foreign_gltf_sounds_at_its_frequencies_and_dies_at_its_rates(self):
        document, path = self.foreign(), self.folder / "foreign.gltf"
        jsonschema.validate(document, gltf.SCHEMA)
        path.write_text(json.dumps(document))
        model, said = self.imported(path)
        figures = dict(re.findall(r"--([\w-]+) ([0-9.e+:,-]+)", said))
        losses = dict(map(float, point.split(":")) for point in figures["loss-factor"].split(","))
        material = carillon.material(young_pa=float(figures["young"]), density_kg_per_m3=float(figures["density"]),
                                     loss_factor=losses)
        samples = self.heard(model, material, 0.6)
        for frequency_hz, decay_per_s in zip(self.FREQUENCIES_HZ, self.DECAYS_PER_S):
            partial = sound.measure(samples, frequency_hz, 0.06, 0.4)
            self.assertLess(abs(partial.frequency_hz - frequency_hz), 0.05)
            self.assertLess(abs(partial.decay_per_s / -decay_per_s - 1), 0.01)
        listed = self.daemon.json("model", "show", model)
        self.assertEqual(listed["label"], "from elsewhere")
        self.assertEqual(listed["header"]["solver"], "glTF by a test")

    def test_a_material_goes_with_gltf_and_with_nothing_else(self):
        material = ("--material", meshes.MATERIAL)
        for reason, kind, *options in (("INVALID_SETTINGS", "glb"), ("INVALID_SETTINGS", "npz", *material),
                                       ("POISSON_RATIO_DIFFERS", "glb", *material, "--poisson", 0.1)):
            self.assertEqual(self.daemon.refusal("model", "export", self.name, "--out",
                                                 self.folder / f"material.{kind}", *options), reason)
