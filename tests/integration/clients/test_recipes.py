# SPDX-License-Identifier: Apache-2.0
"""The recipes of docs/: the program of each page runs as the page says, with a real daemon."""

import base64
import json
import os
import pathlib
import re
import subprocess
import textwrap

import numpy

import carillon
import sound
from daemon import BIN, BUILD, ROOT, DaemonTest
from test_c_client import installed

MOST_LINES = 60


class RecipesTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.library = installed(cls.folder / "prefix").parent
        subprocess.run([BIN / "carillon", "example", "bar"], cwd=cls.folder, check=True, stdout=subprocess.DEVNULL)
        cls.environment = {**os.environ, "CARILLON_SERVER": cls.daemon.server, "LD_LIBRARY_PATH": str(cls.library),
                           "PYTHONPATH": str(BUILD / "client_sdk/python")}

    def save(self, page, language, name, number=0):
        program = re.findall(rf"(?ms)^```{language}\n(.*?)^```", (ROOT / "docs" / page).read_text())[number]
        self.assertLessEqual(program.count("\n"), MOST_LINES)
        (self.folder / name).write_text(program)
        return name

    def run_here(self, *words, path=()):
        """What a program in the folder ends with. `path` has folders of packages for Node."""
        environment = {**self.environment, "NODE_PATH": ":".join(map(str, path))}
        return subprocess.run(words, cwd=self.folder, env=environment, check=False, capture_output=True, text=True)

    def run_well(self, *words, path=()):
        """What a program prints that complains about nothing."""
        done = self.run_here(*words, path=path)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout

    def hear_the_bar(self, *words):
        """The bar falls, meets the floor once, and lies there in silence."""
        with self.c.recording() as heard:
            said = self.run_well(*words, "bar.obj")
            heard.take(0.5)
        self.assertEqual(said, "1 blows sounded, 0 contacts were rejected\n")
        self.assertGreater(heard.sound.peak, 1e-4)
        wrong = self.run_here(*words, "none.obj")
        self.assertNotEqual(wrong.returncode, 0)
        self.assertIn("FILE_NOT_FOUND", wrong.stdout + wrong.stderr)

    def test_unity(self):
        self.run_well("mcs", self.save("recipe_unity.md", "csharp", "Fall.cs"))
        self.hear_the_bar("mono", "Fall.exe")

    def test_rust(self):
        # Debian's compiler, not one that a user has beside it.
        self.run_well("/usr/bin/rustc", "-O", "-L", self.library, self.save("recipe_rust.md", "rust", "fall.rs"),
                      "-o", "fall_rust")
        self.hear_the_bar("./fall_rust")

    def test_unreal(self):
        self.run_well("g++", "-std=c++17", "-fno-exceptions", "-fno-rtti", "-Wall", "-Wextra", "-Werror",
                      self.save("recipe_unreal.md", "cpp", "fall.cpp"), "-o", "fall_unreal",
                      f"-I{self.folder}/prefix/include", f"-L{self.library}", "-lcarillon")
        self.hear_the_bar("./fall_unreal")

    def run_python(self, page, number=0):
        """Runs a program of the page, and returns what it prints."""
        return self.run_well("/usr/bin/python3", self.save(page, "python", f"{page}.{number}.py", number))

    def test_a_rod_on_steps_in_rapier(self):
        page = (ROOT / "docs/engines.md").read_text()
        program = page[page.index("    const rapier"):page.index("Call `removeObject")]
        (self.folder / "rod.js").write_text(textwrap.dedent(program))
        package = self.folder / "node_modules/carillon"
        package.mkdir(parents=True)
        for name in ("node/lib", "node/package.json", "adapters"):
            (package / name.split("/")[-1]).symlink_to(ROOT / "client_sdk" / name)
        places = (package.parent, os.environ["CARILLON_NODE_MODULES"], os.environ["CARILLON_ENGINE_MODULES"])
        self.assertRegex(self.run_well("node", "rod.js", path=places), r"blowCount: [1-9]")
        self.assertGreater(numpy.abs(sound.read_wave(self.folder / "rod.wav")).max(), 1e-4)

    def test_mcap(self):
        self.save("recipe_mcap.md", "js", "mcap.js")
        bar = self.c.create_model(self.folder / "bar.obj", material="brass")
        bar.wait_for_transfer()
        trace = carillon.Trace(1 / 240)
        handle = trace.add(bar)
        trace.step(0.25, impacts=carillon.Impacts(handle, (0.1, 0.015, 0.008), (0, 0, -0.02), durations=0.0005))
        trace.write(self.folder / "drop.contacts")
        heard = self.c.render(trace)
        modules = self.folder / "mcap_modules"
        modules.mkdir()
        (modules / "carillon").symlink_to(ROOT / "client_sdk/node")
        path = (modules, os.environ["CARILLON_NODE_MODULES"])
        self.run_well("node", "mcap.js", "drop.contacts", "drop.mcap", "1764417600", path=path)
        metadata, *messages = json.loads(self.run_well(
            "node", pathlib.Path(__file__).with_name("read_mcap.js"), "drop.mcap", path=path))
        audio = [message for message in messages if message["topic"] == "/sound"]
        (impact,) = (message for message in messages if message["topic"] == "/impacts")
        self.assertEqual({message["schema"] for message in audio}, {"foxglove.RawAudio"})
        levels = numpy.concatenate([numpy.frombuffer(base64.b64decode(message["data"]), "<i2") for message in audio])
        self.assertEqual(numpy.abs(levels).max(), 32767)  # however quiet it is
        lsb_pa = float(metadata["full_scale_pa"]) / 32767
        self.assertAlmostEqual(32767 * lsb_pa, heard.summary.peak_pa, delta=1e-6 * heard.summary.peak_pa)
        numpy.testing.assert_allclose(levels * lsb_pa, heard.mono * heard.summary.full_scale_pa, rtol=0,
                                      atol=0.51 * lsb_pa)
        self.assertEqual({(message["format"], message["sample_rate"], message["number_of_channels"])
                          for message in audio}, {("pcm-s16", 48000, 1)})
        for number, message in enumerate(audio):
            seconds, milliseconds = divmod(20 * number, 1000)
            self.assertEqual(message["timestamp"], {"sec": 1764417600 + seconds, "nsec": 10**6 * milliseconds})
            self.assertEqual(message["logTime"], f"{1764417600 + seconds}{milliseconds:03d}000000")
        self.assertEqual((impact["schema"], impact["object"]), ("carillon.Impact", handle))
        self.assertAlmostEqual(int(impact["logTime"]) / 1e9 - 1764417600, 0.25, delta=1e-4)
        self.assertAlmostEqual(impact["impulse_newton_seconds"]["z"], -0.02, places=6)
        self.assertAlmostEqual(impact["point_m"]["x"], 0.1, places=6)
        self.assertAlmostEqual(impact["duration_s"], 0.0005, places=8)

    def test_sampler(self):
        program = self.folder / self.save("recipe_sampler.md", "python", "sampler.py")
        program.write_text(program.read_text().replace("-0.2 *", "-1e-4 *"))  # as if the bar were quieter by 66 dB
        self.run_well("/usr/bin/python3", program)
        regions = re.findall(r"sample=(\S+) .*pitch_keycenter=(\d+) lovel=(\d+)", (self.folder / "bar.sfz").read_text())
        self.assertEqual(len(regions), 21)
        treble = {}
        for file, key, velocity in regions:
            heard = sound.read_wave(self.folder / file)[:48000, 0]
            spectrum = numpy.abs(numpy.fft.rfft(heard * numpy.hanning(len(heard))))  # a line is a hertz
            lowest = int(spectrum[:int(1.5 * 440 * 2**((int(key) - 69) / 12))].argmax())
            self.assertGreater(numpy.abs(heard).max(), 0.19)
            self.assertAlmostEqual(lowest, 440 * 2**((int(key) - 69) / 12), delta=1.1, msg=file)
            treble[key, velocity] = (spectrum[2 * lowest:]**2).sum() / (spectrum**2).sum()
        for key in {key for _, key, _ in regions}:
            self.assertLess(treble[key, "1"], treble[key, "48"])
            self.assertLess(treble[key, "48"], treble[key, "96"])

    def test_partials(self):
        printed = self.run_python("recipe_sampler.md", number=1)
        self.assertLess(float(re.fullmatch(r"left over: (-\d+) dB\n", printed)[1]), -40)
        table = numpy.genfromtxt(self.folder / "bar.csv", delimiter=",", names=True)
        (bar,) = (model for model in self.c.models() if model.material.preset == "brass")
        strike = {"point": (0.1, 0.015, 0.008), "impulse": (0, 0, -0.2), "duration": 0.0005, "seconds": 0.3}
        gain = 0.1 / bar.render_strike(**strike, gain=0.01).peak * 0.01
        struck = bar.render_strike(**strike, gain=gain)
        heard_pa = struck.mono * struck.summary.peak_pa / struck.peak / gain
        times_s = (numpy.arange(len(heard_pa)) - numpy.flatnonzero(heard_pa)[0])[:, numpy.newaxis] / 48000
        waves = numpy.cos(2 * numpy.pi * table["frequency_hz"] * times_s + table["phase_rad"])
        made_pa = (table["amplitude_pa"] * waves * 10 ** (-3 * times_s / table["t60_s"])).sum(axis=1)
        rings = slice(480, -960)  # after the contact, and before the end fades out
        self.assertLess(numpy.std((made_pa - heard_pa)[rings]), 0.01 * numpy.std(heard_pa[rings]))

    def test_room(self):
        printed = self.run_python("recipe_room.md")
        full_scale_pa = float(re.match(r"full scale: (\S+) Pa at 1 m, outside of the harmonics: -\d+ dB$", printed)[1])
        channels = sound.read_wave(self.folder / "bar.wav").T * full_scale_pa
        # The harmonics of the orders 0 to 3 in a direction of the plane y = 0, between the program's directions.
        x, _, z = direction = (0.6, 0, 0.8)
        harmonics = numpy.zeros(16)
        harmonics[[0, 2, 3, 6, 7, 8]] = 1, z, x, (3 * z**2 - 1) / 2, 3**0.5 * x * z, 0.75**0.5 * x**2
        harmonics[[12, 13]] = (5 * z**3 - 3 * z) / 2, (3 / 8)**0.5 * x * (5 * z**2 - 1)
        harmonics[[14, 15]] = (15 / 4)**0.5 * x**2 * z, (5 / 8)**0.5 * x**3
        (bar,) = (model for model in self.c.models() if model.material.preset == "brass")
        with self.c.perform(step=0.02, microphones=[carillon.Omni(at=[100 * axis for axis in direction])],
                            hearing={"directivity": True, "distance_gain": False}) as heard:
            handle = heard.add(bar)
            strike = carillon.Impacts([handle], [(0.1, 0.015, 0.008)], [(0, 0, -0.02)])
            steps = [heard.step(impacts=strike if step == 5 else None)[0] for step in range(55)]
        pressure_pa = numpy.concatenate(steps, axis=2)[0, 0, 5 * 960:]
        difference_pa = harmonics @ channels - pressure_pa

        def energy(pressures_pa, most_hz):
            window = numpy.hanning(len(pressures_pa))
            return (numpy.abs(numpy.fft.rfft(window * pressures_pa))[:most_hz]**2).sum()  # a line is a hertz

        self.assertGreater(energy(pressure_pa, 2000), 1e-3 * energy(pressure_pa, 24000))
        self.assertLess(energy(difference_pa, 2000), 1e-4 * energy(pressure_pa, 2000))

    def test_cracked_vase(self):
        printed = self.run_python("recipe_cracked_vase.md")
        figures = re.findall(r"(?m)^(\w+): \[ *([\d.]+).*\] Hz, T60 ([\d.]+) s$", printed)
        (whole, whole_hz, whole_s), (cracked, cracked_hz, cracked_s) = figures
        self.assertEqual((whole, cracked), ("whole", "cracked"))
        self.assertLess(float(cracked_hz), 0.9 * float(whole_hz))
        self.assertLess(float(cracked_s), 0.5 * float(whole_s))
        for name in (whole, cracked):
            self.assertGreater(numpy.abs(sound.read_wave(self.folder / f"{name}.wav")).max(), 1e-3)
