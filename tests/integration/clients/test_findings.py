# SPDX-License-Identifier: Apache-2.0
"""The mistakes of an engine that the motion of its bodies shows: the daemon names them, every client tells the same."""

import asyncio
import ctypes
import json
import subprocess
import types
import warnings

import carillon
import meshes
import test_c_client
from daemon import node_environment
from test_python_package import PackageTest

RATE_HZ, STEP_COUNT = 240, 1440
MASS_KG = meshes.DENSITY * meshes.BAR_SIZE[0] * meshes.BAR_SIZE[1] * meshes.BAR_SIZE[2]
UNDER_THE_CENTRE = (meshes.BAR_SIZE[0] / 2, meshes.BAR_SIZE[1] / 2, 0)
NODE = """
const carillon = require('carillon');
(async () => {
  const c = carillon.connect(process.argv[1]);
  const told = {};
  for (const file of process.argv.slice(2)) {
    told[file] = (await c.render(file, { tailS: 0.1 })).summary.warnings;
  }
  c.close();
  console.log(JSON.stringify(told));
})();
"""


def falls():
    """Yields the height of a bar that falls and bounces, by symplectic Euler, and the speed that the floor gives it in
    the step; a hand lifts it whenever it has come to rest."""
    height_m, speed, step_s = 0.5, 0.0, 1 / RATE_HZ
    for i in range(STEP_COUNT):
        speed -= 9.81 * step_s
        given = 0.0
        if height_m + speed * step_s < 0:
            after = -0.6 * speed if speed < -0.5 else -height_m / step_s
            given, speed = after - speed, after
        height_m += speed * step_s
        yield height_m, given
        if i % 480 == 479:
            height_m, speed = 0.5 + 0.013 * (i // 480), 0.0


def told_by(mistake):
    """The impulses of each step, N s upward, as an engine reports them that makes the mistake."""
    impulses = [[MASS_KG * given] if given else [] for _, given in falls()]
    leaps = [given > 0.5 for _, given in falls()]
    return {"none": impulses,
            "forces": [[j * RATE_HZ for j in step] for step in impulses],
            "twice": [2 * step for step in impulses],
            "heavy": [[3 * j for j in step] for step in impulses],
            "reversed": [[-j for j in step] for step in impulses],
            "late": [[], *impulses[:-1]],
            "first zero": [[0.0] if leap else step for leap, step in zip(leaps, impulses)]}[mistake]


class FindingsTest(PackageTest):
    EXPECTED = {"none": {}, "forces": {"IMPULSES_ARE_FORCES": 240}, "twice": {"CONTACTS_TWICE": 2},
                "heavy": {"MASSES_DIFFER": 3}, "reversed": {"IMPULSES_REVERSED": None},
                "late": {"CONTACTS_ONE_STEP_LATE": None}, "first zero": {"FIRST_IMPULSES_ZERO": None}}

    @staticmethod
    def send(steps, item, mistake):
        heights = [height_m for height_m, _ in falls()]
        for i, impulses in enumerate(told_by(mistake)):
            contacts = carillon.Contacts(item, [UNDER_THE_CENTRE] * len(impulses), [(0, 0, j) for j in impulses],
                                         partners=1) if impulses else None
            steps.step((i + 1) / RATE_HZ, contacts=contacts, poses=carillon.Poses(item, [(0, 0, heights[i])]))

    def write(self, mistake):
        trace = carillon.Trace(1 / RATE_HZ)
        self.send(trace, trace.add(self.model, gain=0.01), mistake)
        file = self.folder / f"{mistake.replace(' ', '_')}.contacts"
        trace.write(file)
        return file

    def test_every_client_tells_the_mistakes_of_an_engine_with_the_figures_of_the_daemon(self):
        files = {mistake: self.write(mistake) for mistake in self.EXPECTED}
        node = subprocess.run(["node", "-e", NODE, self.c.server, *files.values()], check=True, capture_output=True,
                              text=True, env=node_environment(self.folder)).stdout
        of_node = json.loads(node)
        c = ctypes.CDLL(str(test_c_client.installed(self.folder / "prefix")))
        c.carillon_warnings.restype = ctypes.c_char_p
        for mistake, file in files.items():
            with self.subTest(mistake), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                told = self.c.render(file, tail_s=0.1).summary.warnings
                figures = {one.id: one.figures.get("ratio") for one in told}
                self.assertEqual(sorted(figures), sorted(self.EXPECTED[mistake]))
                for one in told:
                    ratio = self.EXPECTED[mistake][one.id]
                    self.assertEqual(one.figures["object"], 1)
                    self.assertGreaterEqual(one.count, 3)
                    if ratio:
                        self.assertAlmostEqual(one.figures["ratio"] / ratio, 1, delta=0.02)
                by_node = {one["id"]: (one["count"], one["text"], one["figures"]) for one in of_node[str(file)]}
                lines = [f"{one.id}: {one.text}" for one in told]
                self.assertEqual(self.c_lines(c, file), lines)
                printed = self.daemon.command("render", file, "--out", self.folder / "x.wav", "--tail", 0.1)
                for one, line in zip(told, lines):
                    self.assertEqual(by_node[one.id], (one.count, one.text, dict(one.figures)))
                    self.assertIn(line, (printed.stdout + printed.stderr).splitlines())

    def test_a_live_stream_tells_what_the_rendering_tells(self):
        with self.c.scene() as scene, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            bar = scene.add(self.model, gain=0.01)
            with scene.stream(step=1 / RATE_HZ) as stream:
                self.send(stream, bar, "heavy")
            live = {one.id: dict(one.figures) for one in stream.report.warnings}
            self.assertEqual(live["MASSES_DIFFER"], self.rendered_figures())

    def rendered_figures(self):
        """What the rendering of the same mistake tells."""
        told, = self.c.render(self.write("heavy"), tail_s=0.1).summary.warnings
        self.assertEqual(told.id, "MASSES_DIFFER")
        return dict(told.figures)

    def test_a_performance_tells_at_its_end_what_the_rendering_tells(self):
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            with self.c.perform(step=1 / RATE_HZ, environments=2) as sound:
                bar = sound.add(self.model, gain=0.01)
                self.send(types.SimpleNamespace(step=lambda _, **content: sound.step(**content)), bar, "heavy")
                sound.reset()
            rendered = self.rendered_figures()
        kept, = sound.warnings
        self.assertEqual(kept.figures["object"], rendered["object"])
        self.assertAlmostEqual(kept.figures["ratio"], rendered["ratio"], places=6)
        self.assertEqual([one.message.id for one in told], ["MASSES_DIFFER"] * 2)

    def test_a_performance_of_asyncio_tells_it_too(self):
        async def perform():
            async with carillon.aio.connect(self.c.server) as c, c.perform(step=1 / RATE_HZ) as sound:
                bar = sound.add(self.model, gain=0.01)
                for _ in range(3):
                    await sound.step(contacts=carillon.Contacts(bar, [(9, 9, 9)], [(0, 0, 1e-3)], partners=1))
            return sound.warnings

        with self.assertWarns(carillon.ContactWarning) as told:
            kept, = asyncio.run(perform())
        self.assertEqual((told.warning.id, kept.id, kept.count), ("POINTS_DISTANT", "POINTS_DISTANT", 3))

    def c_lines(self, library, file):
        connection, sound = ctypes.c_void_p(), test_c_client.Sound()
        settings = test_c_client.RenderSettings(48000, 1, 0.1)
        self.assertEqual(library.carillon_connect(self.c.server.encode(), ctypes.byref(connection)), 0)
        self.addCleanup(library.carillon_disconnect, connection)
        self.assertEqual(library.carillon_render(connection, str(file).encode(), ctypes.byref(settings),
                                                 ctypes.byref(sound)), 0)
        library.carillon_free_sound(ctypes.byref(sound))
        return library.carillon_warnings().decode().splitlines()
