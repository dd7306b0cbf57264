# SPDX-License-Identifier: Apache-2.0
"""A bar that is fixed at one end, through the daemon: each way to say so is the same sound, and it is silent there."""

import meshes
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

    def create(self, fixture):
        """The name of the bar's model."""
        printed = self.daemon.command("model", "create", self.bar, "--material", meshes.MATERIAL, "--nodes", 300,
                                      "--band", "20:6000", "--wait", "--fix", fixture)
        return printed.stdout.strip()

    def eigenvalues(self, model):
        return tuple(self.daemon.json("model", "show", model)["eigenvalues"])

    def test_every_way_to_say_it_is_a_model_of_its_own_with_the_same_sound(self):
        models = {self.create(fixture) for fixture in (CLAMP, "plane:0,5,5/2,0,0", "group:end", "vertices:0,3,4,7",
                                                       f"box:0,0,0/0,{WIDTH},{HEIGHT}")}
        self.assertEqual(len(models), 5)
        self.assertEqual(len({self.eigenvalues(model) for model in models}), 1)

    def test_blow_is_heard_where_the_bar_moves_and_not_where_it_is_fixed(self):
        model = self.c.model(self.create(CLAMP))
        free, fixed = (model.render_strike((x, WIDTH / 2, HEIGHT), (0, 0, -0.01), duration=0, seconds=0.5)
                       for x in (LENGTH, 0))
        self.assertGreater(free.peak, 1e-4)
        self.assertEqual(fixed.peak, 0)
