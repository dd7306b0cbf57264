# SPDX-License-Identifier: Apache-2.0
"""A bar that is fixed at one end, through the daemon: another model than the free one, an octave and more lower,
silent where it is fixed."""

import json
import math
import unittest

import meshes
import sound
from carillon.v1 import contact_pb2, contact_trace_pb2, material_pb2
from daemon import DaemonTest

LENGTH, WIDTH, HEIGHT = meshes.BAR_SIZE
# The plane x = 0 lies at the end of the bar.
CLAMP = "plane:0,0,0/1,0,0"


def bar_with_an_end():
    """The bar, its faces at x = 0 in a group of their own."""
    vertices, faces = meshes.box(meshes.BAR_SIZE)
    end = [face for face in faces if set(face) <= {0, 3, 4, 7}]
    lines = meshes.obj(vertices, end + [face for face in faces if face not in end]).split(b"\n")
    lines.insert(len(vertices) + len(end), b"g rest")
    lines.insert(len(vertices), b"g end")
    return b"\n".join(lines)


class FixedTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.bar = cls.folder / "bar.obj"
        cls.bar.write_bytes(bar_with_an_end())

    def create(self, *options, file=None):
        """The name of the bar's model."""
        printed = self.daemon.command("model", "create", file or self.bar, "--material", meshes.MATERIAL, "--nodes",
                                      300, "--band", "20:6000", "--wait", *options)
        return printed.stdout.strip()

    def header(self, model):
        return json.loads(self.daemon.command("--json", "model", "show", model).stdout)["header"]

    def frequencies_hz(self, model):
        shown = json.loads(self.daemon.command("--json", "model", "show", model).stdout)
        return [math.sqrt(value * meshes.YOUNG_PA / meshes.DENSITY) / (2 * math.pi)
                for value in shown["eigenvalues"]]

    def test_first_mode_is_that_of_a_cantilever(self):
        fixed = self.frequencies_hz(self.create("--fix", CLAMP))
        euler = (1.875104**2 / (2 * math.pi * LENGTH**2)
                 * math.sqrt(meshes.YOUNG_PA * HEIGHT**2 / (12 * meshes.DENSITY)))
        # Clamped against narrowing it is a little stiffer than Euler's, by some parts in a thousand.
        self.assertAlmostEqual(fixed[0] / euler, 1, delta=0.015)
        free = self.frequencies_hz(self.create())
        self.assertGreater(free[0] / fixed[0], 6)

    def test_every_way_to_say_it_is_a_model_of_its_own_with_the_same_sound(self):
        models = {self.create("--fix", CLAMP), self.create("--fix", "plane:0,5,5/2,0,0"),
                  self.create("--fix", "group:end"), self.create("--fix", "vertices:0,3,4,7"),
                  self.create("--fix", f"box:0,0,0/0,{WIDTH},{HEIGHT}")}
        self.assertEqual(len(models), 5)
        self.assertEqual(len({tuple(self.frequencies_hz(model)) for model in models}), 1)

    def test_order_of_fixtures_is_no_part_of_the_name(self):
        ends = ["--fix", CLAMP, "--fix", f"plane:{LENGTH},0,0/-1,0,0"]
        model = self.create(*ends)
        self.assertEqual(model, self.create(*ends[2:], *ends[:2]))
        proof = self.header(model)["verification"]
        self.assertEqual(proof.get("rigid_mode_count", 0), 0)

    def test_blow_is_heard_where_the_bar_moves_and_not_where_it_is_fixed(self):
        model = self.create("--fix", CLAMP)

        def loudness(x):
            body = contact_trace_pb2.ContactTraceObject(
                handle=1, modal_model=model, material=material_pb2.Material(preset=meshes.MATERIAL))
            blow = contact_pb2.ContactStep(
                time_s=0, contacts=[sound.impulse((x, WIDTH / 2, HEIGHT), (0, 0, -0.01))])
            samples, _ = sound.render(self.daemon, [body], [blow], 0.5)
            return abs(samples).max()

        self.assertGreater(loudness(LENGTH), 1e-4)
        self.assertEqual(loudness(0), 0)

    def test_tetrahedra_of_tetgen_and_medit_are_fixed_by_their_own_names(self):
        nodes, tetrahedra = meshes.tetrahedra_of_bar(16, 2, 1)
        at_end = [1 if x == 0 else 0 for x, _, _ in nodes]
        node_file = self.folder / "bar.node"
        node_file.write_text(f"{len(nodes)} 3 0 1\n" + "".join(
            f"{i} {x} {y} {z} {end}\n" for i, ((x, y, z), end) in enumerate(zip(nodes, at_end))))
        self.folder.joinpath("bar.ele").write_text(f"{len(tetrahedra)} 4 0\n" + "".join(
            f"{i} {a} {b} {c} {d}\n" for i, (a, b, c, d) in enumerate(tetrahedra)))
        medit_file = self.folder / "bar.mesh"
        medit_file.write_text(f"MeshVersionFormatted 2\nDimension 3\nVertices {len(nodes)}\n" + "".join(
            f"{x} {y} {z} {end}\n" for (x, y, z), end in zip(nodes, at_end))
            + f"Tetrahedra {len(tetrahedra)}\n" + "".join(
                f"{a + 1} {b + 1} {c + 1} {d + 1} 0\n" for a, b, c, d in tetrahedra) + "End\n")
        by_plane, by_marker, by_reference = (
            self.create("--fix", fixture, file=file)
            for file, fixture in ((node_file, CLAMP), (node_file.with_suffix(".ele"), "group:1"),
                                  (medit_file, "group:1")))
        frequencies = self.frequencies_hz(by_plane)
        self.assertGreater(len(frequencies), 3)
        # The mid-side nodes between those that are marked are fixed, too.
        self.assertEqual(self.frequencies_hz(by_marker), frequencies)
        self.assertEqual(self.frequencies_hz(by_reference), frequencies)

    def test_refusals_say_what_is_fixed(self):
        for fixture, reason, status in (
                ("group:nose", "GROUP_UNKNOWN", 1), ("vertices:77", "NO_VERTEX_FIXED", 1),
                ("plane:0,0,0/-1,0,0", "ALL_VERTICES_FIXED", 1), ("floor", "--fix", 2)):
            with self.subTest(fixture):
                ended = self.daemon.command("model", "create", self.bar, "--material", meshes.MATERIAL, "--wait",
                                            "--fix", fixture, check=False)
                self.assertEqual(ended.returncode, status)
                self.assertIn(f"{reason}: ", ended.stderr)


if __name__ == "__main__":
    unittest.main()
