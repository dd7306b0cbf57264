# SPDX-License-Identifier: Apache-2.0
"""The command line as people and scripts use it, against the real daemon."""

import json
import math
import re
import subprocess
import unittest

import numpy

import carillon
import meshes
import sound
from daemon import BIN, ROOT, Daemon, DaemonTest

CREATE = ("model", "create", "--material", meshes.MATERIAL)
STRIKE = ("strike", "bar", "--point", "0,0.008,0.01", "--impulse", "0,0,-0.01", "--seconds", "0.01")


def run_alone(*arguments, **options):
    """Runs `carillon` where no daemon need be."""
    return subprocess.run([BIN / "carillon", *map(str, arguments)], capture_output=True, text=True, check=False,
                          **options)


class CommandLineTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model = cls.run_command(*CREATE, cls.write_box("bar", meshes.BAR_SIZE), "--wait")

    @classmethod
    def write_box(cls, name, sides):
        """The mesh file of a box."""
        (cls.folder / f"{name}.obj").write_bytes(meshes.obj(*meshes.box(sides)))
        return cls.folder / f"{name}.obj"

    def write_trace(self, newton_seconds=0.002):
        """A trace of the bar that is struck once."""
        trace = carillon.Trace()
        bar = trace.add(self.model, meshes.MATERIAL)
        trace.step(0, impacts=carillon.Impacts(bar, [(0, 0.008, 0.010)], [(0, 0, -newton_seconds)], durations=1e-4))
        trace.write(self.folder / "trace.contacts")
        return self.folder / "trace.contacts"

    @classmethod
    def run_command(cls, *arguments):
        return cls.daemon.command(*arguments).stdout.strip()

    def errors_of(self, *arguments):
        """What a command that need not succeed says to people."""
        return self.daemon.command(*arguments, check=False).stderr


class ListsTest(CommandLineTest):
    def test_numbers_of_64_bits_are_numbers_in_json(self):
        shown = self.daemon.json("model", "show", "bar")
        for name in ("stored_bytes", "created_unix_ms", "revision"):
            self.assertIsInstance(shown[name], int)
        self.assertEqual(shown["label"], "bar")
        self.assertIsInstance(shown["eigenvalues"][0], float)
        self.assertEqual(shown["header"]["settings"]["element"], "ELEMENT_QUADRATIC")
        # Listed, it takes less than two kilobytes.
        listed = self.daemon.json("model", "list", "--label", "bar")["modal_models"]
        self.assertEqual([model["name"] for model in listed], [self.model])
        self.assertLess(len(json.dumps(listed)), 2000)
        self.assertEqual(listed[0]["header"]["mode_count"], shown["header"]["mode_count"])

    def test_jobs_are_listed_shown_and_cancelled(self):
        self.assertIn("bar", [job["label"] for job in self.daemon.json("job", "list")["jobs"]])
        self.assertRegex(self.run_command("job", "show", "bar"), "done\n(.*\n)*requested  20.* ago")
        labels = ("one", "long\u202e")
        for i, label in enumerate(labels):
            self.run_command(*CREATE, self.folder / "bar.obj", "--nodes", 60000 + i, "--label", label, "--no-wait")
        self.assertRegex(self.run_command("job", "list"), r"(requested|running for) [0-9]+ s.*  long\\xe2\\x80\\xae")
        self.assertIn("JOB_NOT_FOUND", self.errors_of("job", "cancel", labels[0], "bar", labels[1]))
        for label in labels:
            self.assertIn("JOB_CANCELLED", self.errors_of("job", "watch", label))

    def test_jobs_are_listed_and_watched_by_state_and_label(self):
        listed = self.daemon.json("job", "list", "--state", "succeeded", "--label", "BAR")["jobs"]
        self.assertIn("bar", [job["label"] for job in listed])
        self.assertEqual(self.run_command("job", "list", "--state", "failed,cancelled", "--label", "bar"), "")
        self.assertIn("--state", self.errors_of("job", "list", "--state", "lost"))
        watched = self.write_box("watched", [1.02 * side for side in meshes.BAR_SIZE])
        with subprocess.Popen([BIN / "carillon", "--json", "--server", self.daemon.server, "job", "watch", "--label",
                               "watched"], stdout=subprocess.PIPE, text=True) as watch:
            self.run_command(*CREATE, watched, "--wait")
            self.run_command(*CREATE, self.folder / "bar.obj", "--label", "other", "--wait")
            states = []
            while "JOB_STATE_SUCCEEDED" not in states:
                job = json.loads(watch.stdout.readline())
                self.assertEqual(job["label"], "watched")
                states.append(job["state"])
            watch.terminate()

    def test_the_doctor_finds_no_fault_with_a_daemon_and_says_what_to_do_without_one(self):
        told = self.daemon.json("doctor")
        self.assertEqual(told["fault_count"], 0)
        self.assertEqual([(found["verdict"], found["subject"]) for found in told["findings"]],
                         [("OK", subject) for subject in ("carillond", "carillon.v1.AudioService",
                                                          "carillon.v1.ModalModelService",
                                                          "carillon.v1.DecompositionService")])
        nobody = self.daemon.command("doctor", server=f"unix:{self.folder}/nobody", check=False)
        self.assertEqual(nobody.returncode, 3)
        self.assertRegex(nobody.stderr, "^carillon: SERVER_UNAVAILABLE: .*; start it there")

    def test_materials_are_listed_and_shown_with_their_source(self):
        self.assertRegex(self.run_command("material"), r"(?m)^bell_bronze +\d+ GPa +\d+ kg/m\^3$")
        self.assertRegex(self.run_command("material", "bell_bronze"), r"source +\w")
        self.assertRegex(self.errors_of("material", "bell_bronce"), "UNKNOWN_MATERIAL: .*bell_bronze")
        for words in (("list",), ("show", "oak")):
            self.assertIn("`carillon material` lists", self.errors_of("material", *words))

    def test_scenes_are_listed_with_their_objects_and_deleted(self):
        made = self.c.scene()
        made.add(self.model, meshes.MATERIAL, handle=5)
        scene = made.name
        listed = next(item for item in self.daemon.json("scene", "list")["scenes"] if item["name"] == scene)
        self.assertEqual((listed["object_count"], listed["gain"], listed["muted"]), (1, 1, False))
        self.assertRegex(self.run_command("scene", "list"), rf"(?m){scene}  1 object  gain 1  .*1 connection\n  5 ")
        self.run_command("scene", "delete", scene.removeprefix("scenes/"))
        self.assertNotIn(scene, self.run_command("scene", "list"))


class StatusTest(CommandLineTest):
    def test_the_status_has_the_mixer_and_the_version_limits_and_features(self):
        shown = self.daemon.json("status")
        self.assertEqual((shown["device"], shown["object_count"]), ("null", 0))
        server = shown["server"]
        self.assertEqual((server["version"], server["limits"]["scene_count"]), (carillon.__version__, 512))
        self.assertIn("decomposition", server["features"])
        text = self.run_command("status")
        self.assertRegex(text, r"(?m)^carillond \S+ at unix:.*\ndevice +null: 48000 Hz, 1 channel, ")
        self.assertRegex(text, r"(?m)^limits +512 scenes, ")


class VolumeTest(CommandLineTest):
    def test_the_volume_of_the_output_and_of_a_scene_is_changed_and_shown(self):
        self.assertEqual(self.run_command("volume", "--gain", "-6dB"), "output  gain 0.5012 (-6.0 dB)")
        self.assertEqual(self.run_command("volume", "--gain", "1", "--mute"), "output  gain 1 (+0.0 dB)  muted")
        self.assertEqual(self.run_command("volume", "--unmute"), "output  gain 1 (+0.0 dB)")
        scene = self.c.scene().name
        shown = self.daemon.json("volume", "--scene", scene.removeprefix("scenes/"), "--solo", "--gain", "2")
        self.assertEqual((shown["gain"], shown["solo"], shown["muted"]), (2, True, False))
        self.run_command("scene", "delete", scene)
        for words in (("--gain", "loud"), ("--gain", "-6"), ("--solo",), ("--gain",)):
            self.assertEqual(self.daemon.command("volume", *words, check=False).returncode, 2, words)
        self.assertEqual(self.daemon.refusal("volume", "--gain", "2000"), "INVALID_SETTINGS")

    def test_a_recorded_stream_is_rendered_as_it_was_heard(self):
        with self.c.scene() as scene:
            bar = scene.add(self.model, meshes.MATERIAL)
            trace = self.folder / "live.contacts"
            recorder = subprocess.Popen([BIN / "carillon", "--server", self.daemon.server, "scene", "record",
                                         scene.name, "--out", trace], stderr=subprocess.PIPE, text=True)
            self.assertIn("waiting for a contact stream", recorder.stderr.readline())
            with self.c.recording(scene=scene.name) as heard:
                with scene.stream(step=0.01) as stream:
                    for i in range(5):
                        stream.step(0.01 * i, impacts=carillon.Impacts([bar], [(0, 0.008, 0.01)], [(0, 0, -0.002)],
                                                                       durations=1e-4))
                self.assertIn("5 steps", recorder.communicate()[1])
                live = heard.take(1.5)
            self.assertEqual(recorder.returncode, 0)
            rendered = self.c.render(trace, tail_s=0.3)
        before_fade = rendered.samples[:-rendered.sample_rate_hz // 100]
        begin = int(numpy.flatnonzero(live.samples[:, 0])[0]) - int(numpy.flatnonzero(before_fade[:, 0])[0])
        self.assertGreater(rendered.peak, 1e-5)
        numpy.testing.assert_array_equal(live.samples[begin:begin + len(before_fade)], before_fade)


class ExampleTest(CommandLineTest):
    def test_each_example_is_a_body_that_sounds_as_its_hint_says(self):
        files = []
        for name in ("bell", "bowl", "bar", "chime"):
            file = self.folder / "examples" / f"{name}.obj"
            file.parent.mkdir(exist_ok=True)
            written = self.daemon.command("example", name, "--out", file)
            self.assertEqual(written.stdout, f"{file}\n")
            hints = re.findall(r"(?m)^  carillon (.*)$", written.stderr)
            self.assertEqual([hint.split()[0] for hint in hints], ["model", "strike"])
            created = self.run_command(*hints[0].split(), "--wait")
            heard = self.client.listen(1.0, on_start=lambda hint=hints[1]: self.run_command(
                "strike", created, *hint.split()[2:], "--seconds", "0.1"))
            self.assertGreater(max(map(abs, heard.samples)), 1e-4, name)
            files.append(file)
        # All are there already, so that one command for all returns at once.
        self.assertEqual(len(self.run_command("model", "create", *files, "--material", "bell_bronze").split()), 4)


class ReportTest(CommandLineTest):
    def test_a_table_has_a_row_for_each_file_also_for_those_that_fail(self):
        names = ["gläserne Glocke 鐘.obj", "empty.obj", "bar.obj", "missing.obj"]
        self.write_box("gläserne Glocke 鐘", (0.1, 0.01, 0.02))
        (self.folder / names[1]).write_bytes(b"")
        table = self.folder / "table.jsonl"
        files = [self.folder / name for name in names]
        done = self.daemon.command(*CREATE, *files, "--without-transfer", "--report", table, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("SOME_FAILED: 2 of 4 files", done.stderr)
        rows = [json.loads(line) for line in table.read_text().splitlines()]
        order = [row["index"] for row in rows]  # in which the jobs ended
        rows.sort(key=lambda row: row["index"])
        self.assertEqual([row["file"] for row in rows], list(map(str, files)))
        self.assertEqual([row["error"]["reason"] for row in rows[1::2]], ["MESH_EMPTY", "FILE_NOT_FOUND"])
        for row in rows[::2]:
            shown = self.daemon.json("model", "show", row["modal_model"])
            self.assertEqual((row["frequencies_hz"], row["t60_s"]), (shown["frequencies_hz"], shown["t60_s"]))
            self.assertGreater(row["node_count"], 0)
            self.assertEqual(row["warnings"], shown["header"]["warnings"])
            self.assertEqual(row["material"]["preset"], meshes.MATERIAL)
        self.assertEqual(rows[0]["label"], "gläserne Glocke 鐘")
        self.assertGreater(rows[0]["seconds"], 0)
        self.assertEqual(rows[2]["seconds"], 0)  # was there already
        unknown = self.daemon.command("--json", "model", "create", *files, "--material", "oack", check=False)
        self.assertEqual(unknown.stderr.count("UNKNOWN_MATERIAL"), 1)
        self.assertLess(len(unknown.stderr), 300)
        error = json.loads(unknown.stdout)["error"]
        self.assertEqual(error["metadata"]["nearest"], "oak")
        self.assertIn("pine", error["metadata"]["names"].split(","))
        self.assertEqual(done.stdout.split(), [rows[i]["modal_model"] for i in order if i % 2 == 0])

    def test_a_slow_body_keeps_neither_a_row_nor_a_repair_waiting(self):
        folder = self.folder / "batch"
        folder.mkdir()
        daemon = Daemon(folder, "--workers", 2)
        self.addCleanup(daemon.stop)
        box = meshes.box((0.05, 0.01, 0.02))
        for name, mesh in (("slow", meshes.box((2, 2, 0.004))), ("open", (box[0], box[1][1:])),
                           ("large", meshes.box((200, 20, 10)))):
            (folder / f"{name}.obj").write_bytes(meshes.obj(*mesh))
        table = folder / "table.jsonl"
        rows = []
        command = [BIN / "carillon", "--server", daemon.server, *CREATE, "--report", table,
                   *(folder / f"{name}.obj" for name in ("slow", "open", "large"))]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as creation:
            creation.stdout.readline()  # the model of the repaired body; then its row is written
            while len(rows) < 2:
                rows = [json.loads(line) for line in table.read_text().splitlines()]
            jobs = daemon.json("job", "list", "--state", "running,waiting")["jobs"]
            daemon.command("job", "cancel", "slow")
            creation.communicate(timeout=60)
        self.assertEqual([job["label"] for job in jobs], ["slow"])
        self.assertEqual(sorted(row["index"] for row in rows), [1, 2])
        of_file = {row["index"]: row for row in map(json.loads, table.read_text().splitlines())}
        self.assertGreater(of_file[1]["node_count"], 0)
        self.assertEqual([of_file[i]["error"]["reason"] for i in (0, 2)], ["JOB_CANCELLED", "MESH_UNIT_UNCLEAR"])

    def test_frequencies_and_t60_are_those_of_the_material(self):
        shown = self.daemon.json("model", "show", "bar")
        frequencies, decays = self.c.model("bar").modes()
        numpy.testing.assert_allclose(shown["frequencies_hz"], numpy.hypot(frequencies, decays / (2 * math.pi)),
                                      rtol=1e-6)
        numpy.testing.assert_allclose(shown["t60_s"], math.log(1000) / decays, rtol=1e-6)
        undamped = self.daemon.json("model", "show", "bar", "--material", meshes.MATERIAL, "--loss-factor", "0",
                                    "--alpha1", "0", "--alpha2", "0")
        self.assertEqual(set(undamped["t60_s"]), {None})

    def test_a_strike_is_written_to_a_file_and_not_played(self):
        for options, frames in ((("--seconds", "0.5"), 24000), ((), None)):
            file = self.folder / "ein Schlag.wav"
            told = self.daemon.json("strike", "bar", "--point", "0,0.008,0.005", "--impulse", "0,0,-0.01", "--out",
                                    file, "--normalize", *options)
            heard = sound.read_wave(file)[:, 0]
            self.assertEqual((told["file"], told["seconds"]), (str(file), len(heard) / 48000))
            self.assertEqual((told["frame_count"], told["peak"]), (len(heard), told["file_peak"]))
            self.assertGreater(told["integrated_lufs"], -30)
            self.assertEqual(told["material"]["preset"], meshes.MATERIAL)
            self.assertGreater(told["material"]["density_kg_per_m3"], 0)
            self.assertEqual(len(heard), frames or len(heard))
            self.assertAlmostEqual(numpy.abs(heard).max(), 0.9, places=4)
            spectrum = numpy.abs(numpy.fft.rfft(heard[:24000] * numpy.blackman(48000)[24000:]))
            loudest_hz = 2.0 * numpy.argmax(spectrum)
            self.assertLess(numpy.abs(numpy.array(told["frequencies_hz"]) - loudest_hz).min(), 2)
        self.assertEqual(self.daemon.json("scene", "list")["scenes"], [])


class JsonTest(CommandLineTest):
    def test_commands_that_write_a_file_say_in_json_what_they_wrote(self):
        example = self.daemon.json("example", "bar", "--out", self.folder / "json.obj")
        self.assertEqual((example["file"], example["material"]), (f"{self.folder}/json.obj", "maple"))
        self.assertIn("--impulse", example["strike"])
        block = self.daemon.json("example", "bar", "--size", "0.14,0.07,0.01", "--out", self.folder / "block.obj")
        corners = re.findall(r"(?m)^v (\S+) (\S+) (\S+)$", (self.folder / "block.obj").read_text())
        numpy.testing.assert_allclose(numpy.max(numpy.array(corners, float), 0), (0.14, 0.07, 0.01))
        self.assertIn("--point 0.07,0.035,0.01 ", block["strike"])
        exported = self.daemon.json("model", "export", "bar", "--out", self.folder / "json.npz")
        self.assertEqual(exported, {"file": f"{self.folder}/json.npz", "format": "npz", "modal_model": self.model})
        backup = self.folder / "json.db"
        self.assertEqual(self.daemon.json("db", "backup", backup),
                         {"file": str(backup), "byte_count": backup.stat().st_size})
        heard = self.daemon.json("listen", "--seconds", "0.2", "--out", self.folder / "json.wav")
        self.assertEqual(heard, {"file": f"{self.folder}/json.wav", "frame_count": 9600, "lost_frame_count": 0,
                                 "sample_rate_hz": 48000, "channel_count": 1, "peak": 0})
        self.assertEqual(len(sound.read_wave(self.folder / "json.wav")), 9600)


class RenderTest(CommandLineTest):
    def render(self, *options):
        """The samples of the trace of the bar."""
        out = self.folder / "out.wav"
        self.run_command("render", self.folder / "trace.contacts", "--out", out, "--tail", 0.3, *options)
        return sound.read_wave(out)

    def test_a_gain_in_decibels_is_the_same_for_a_file_and_for_a_strike(self):
        self.write_trace()
        numpy.testing.assert_array_equal(self.render("--gain", "-20dB"), self.render("--gain", 0.1))
        self.assertEqual(*(self.run_command(*STRIKE, "--gain", gain) for gain in ("-20dB", 0.1)))

    def test_a_soft_sound_is_normalised_with_its_tail(self):
        self.write_trace()
        plain = self.render("--normalize")
        shown = self.run_command("render", self.write_trace(2e-8), "--out", self.folder / "faint.wav", "--tail", 0.6)
        self.assertIn("raise it by --gain or --normalize", shown)
        self.assertIn("below -70 LUFS", shown)
        # Without the second rendering, the modes would end at a hundredth of the peak.
        numpy.testing.assert_allclose(self.render("--normalize"), plain, atol=1e-4)

    def test_a_length_bounds_the_tail_that_is_rendered(self):
        whole, short = (self.c.render(self.write_trace(), **settings).samples for settings in ({}, {"longest_s": 0.1}))
        self.assertEqual(len(short), round(0.11 * sound.RATE))  # the last 10 ms fade out
        self.assertGreater(len(whole), 2 * len(short))
        numpy.testing.assert_array_equal(short[:4800], whole[:4800])

    def test_a_dash_writes_the_file_to_stdout(self):
        words = ("render", self.write_trace(), "--tail", "0.3", "--out")
        self.run_command(*words, self.folder / "file.wav")
        done = self.daemon.command(*words, "-", text=False)
        self.assertEqual(done.stdout, (self.folder / "file.wav").read_bytes())


class StrikeTest(CommandLineTest):
    def test_a_vector_is_one_word_or_three(self):
        struck = self.run_command("strike", "bar", "--point", "0", "0.008", "0.01", "--impulse", "0", "0", "-0.01",
                                  "--seconds", "0.01")
        self.assertRegex(struck, r"^\d+ modes: .* Hz, sounding by ")
        self.assertEqual(self.run_command(*STRIKE), struck)

    def test_json_has_the_warning_of_the_plain_output(self):
        self.assertEqual(self.daemon.json(*STRIKE)["warnings"], [])
        far = ("strike", "bar", "--impulse", "0,0,-0.01", "--seconds", "0.01", "--point", "0,0,9")
        warning, = self.daemon.json(*far)["warnings"]
        self.assertRegex(warning, "^POINTS_DISTANT: ")
        self.assertEqual(self.errors_of(*far), f"warning: {warning}\n")

    def test_json_has_the_duration_and_the_peak_and_tells_of_the_limiter(self):
        strike = ("strike", "bar", "--point", "0,0.008,0.01", "--duration", "0.002", "--seconds", "0.01", "--impulse")
        shown, loud = (self.daemon.json(*strike, impulse) for impulse in ("0,0,-0.01", "0,0,-100"))
        self.assertAlmostEqual(shown["contact_duration_s"], 0.002)
        self.assertEqual((shown["seconds"], shown["limited_frame_count"]), (0.01, 0))
        self.assertAlmostEqual(loud["peak_pa"], 1e4 * shown["peak_pa"], delta=10 * shown["peak_pa"])
        self.assertGreater(loud["limited_frame_count"], 0)
        self.assertIn("which the limiter lowers", self.run_command(*strike, "0,0,-100"))


class ModelFilesTest(CommandLineTest):
    def test_a_glb_has_the_material_of_the_model_unless_another_is_named(self):
        poisson = self.daemon.json("model", "show", "bar")["header"]["settings"]["poisson_ratio"]
        for material, words in ((meshes.MATERIAL, ()), ("oak", ("--material", "oak", "--poisson", poisson))):
            self.run_command("model", "export", "bar", "--out", self.folder / "remembered.glb", *words)
            self.assertIn(f'"{material}"'.encode(), (self.folder / "remembered.glb").read_bytes())

    def test_an_import_says_that_its_label_is_shared_and_each_outcome_of_a_deletion_is_told(self):
        self.run_command("model", "export", "bar", "--out", self.folder / "shared.npz")
        imported = self.run_command("model", "import", self.folder / "shared.npz")
        self.assertEqual(self.daemon.json("model", "show", "shared")["name"], imported)
        done = self.daemon.command("model", "import", self.folder / "shared.npz", "--label", "bar")
        other = done.stdout.strip()
        shown = other.removeprefix("modalModels/")[:12]
        self.assertIn(f"the label 'bar' now means 2 models: name this one {shown} and the other ", done.stderr)
        self.assertEqual(self.daemon.refusal("model", "show", "bar"), "NAME_AMBIGUOUS")
        deleted = self.daemon.command("model", "delete", "nothing", shown, check=False)
        self.assertEqual((deleted.returncode, deleted.stdout), (1, f"{other} deleted\n"))
        self.assertIn("MODAL_MODEL_NOT_FOUND", deleted.stderr)
        self.run_command("model", "show", "bar")

    def test_a_transfer_for_another_material_comes_with_a_warning(self):
        warned = self.errors_of("transfer", "bar", "--material", "lead", "--no-wait")
        self.assertIn("warning: the material's Poisson's ratio is ", warned)
        self.assertIn(f"warning: the model was made of {meshes.MATERIAL}", warned)
        self.assertEqual(self.errors_of("transfer", "bar", "--material", meshes.MATERIAL), "")


class WithoutDaemonTest(unittest.TestCase):
    def test_a_command_or_an_option_that_is_not_there_names_the_nearest(self):
        for words, nearest in ((("jbo", "list"), "'job'"), (("model", "lst"), "'list'"), (("xyzzy",), "--help"),
                               (("model", "create", "a.obj", "--materal", "oak"), "'--material'")):
            done = run_alone(*words)
            self.assertEqual(done.returncode, 2)
            self.assertRegex(done.stderr, f"^carillon: there is no .*{nearest}")

    def test_a_wall_in_millimetres_is_understood(self):
        done = run_alone("--server", "unix:/nonexistent", "model", "create", ROOT / "README.md", "--wall", "3mm")
        self.assertIn("SERVER_UNAVAILABLE", done.stderr)
