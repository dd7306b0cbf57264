# SPDX-License-Identifier: Apache-2.0
"""The command line as people and scripts use it, against the real daemon."""

import json
import math
import re
import subprocess
import unittest

import numpy

import carillon as carillon_package
import meshes
import sound
from carillon.v1 import contact_pb2, contact_trace_pb2, material_pb2, scene_service_pb2
from daemon import BIN, ROOT, Daemon, DaemonTest

MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)


def carillon(*arguments, **options):
    return subprocess.run([BIN / "carillon", *map(str, arguments)], capture_output=True, text=True, check=False,
                          **options)


class CommandLineTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "bar.obj").write_bytes(meshes.bar())
        cls.model = cls.run_command("model", "create", cls.folder / "bar.obj", "--material", meshes.MATERIAL, "--wait")

    @classmethod
    def run_command(cls, *arguments):
        return cls.daemon.command(*arguments).stdout.strip()

    def json_of(self, *arguments):
        return json.loads(self.run_command("--json", *arguments))


class ListsTest(CommandLineTest):
    def test_numbers_of_64_bits_are_numbers_in_json(self):
        shown = self.json_of("model", "show", "bar")
        for name in ("stored_bytes", "created_unix_ms", "revision"):
            self.assertIsInstance(shown[name], int)
        self.assertEqual(shown["label"], "bar")
        self.assertIsInstance(shown["eigenvalues"][0], float)
        self.assertEqual(shown["header"]["settings"]["element"], "ELEMENT_QUADRATIC")

    def test_a_listed_model_takes_less_than_two_kilobytes(self):
        listed = self.json_of("model", "list")["modal_models"]
        self.assertEqual([model["name"] for model in listed], [self.model])
        self.assertLess(len(json.dumps(listed)), 2000)
        shown = self.json_of("model", "show", "bar")
        self.assertEqual(listed[0]["header"]["mode_count"], shown["header"]["mode_count"])

    def test_jobs_are_listed_shown_and_cancelled(self):
        self.assertIn("bar", [job["label"] for job in self.json_of("job", "list")["jobs"]])
        self.assertRegex(self.run_command("job", "show", "bar"), "done\n(.*\n)*requested  20.* ago")
        self.run_command("model", "create", self.folder / "bar.obj", "--material", meshes.MATERIAL, "--nodes", 60000,
                         "--label", "long\u202e", "--no-wait")
        self.assertRegex(self.run_command("job", "list"), r"(requested|running for) [0-9]+ s.*  long\\xe2\\x80\\xae")
        self.run_command("job", "cancel", "long\u202e")
        ended = self.daemon.command("job", "watch", "long\u202e", check=False)
        self.assertIn("JOB_CANCELLED", ended.stderr)

    def test_several_jobs_are_cancelled_and_an_ended_one_is_named(self):
        for label in ("one", "two"):
            (self.folder / f"{label}.obj").write_bytes(meshes.obj(*meshes.box((0.2, 0.1, 0.05 + len(label) / 100))))
        for label, nodes in (("one", 60000), ("two", 60001)):
            self.run_command("model", "create", self.folder / f"{label}.obj", "--material", meshes.MATERIAL, "--nodes",
                             nodes, "--no-wait")
        ended = self.daemon.command("job", "cancel", "one", "bar", "two", check=False)
        self.assertIn("JOB_NOT_FOUND", ended.stderr)
        for label in ("one", "two"):
            self.assertIn("JOB_CANCELLED", self.daemon.command("job", "watch", label, check=False).stderr)

    def test_jobs_are_listed_and_watched_by_state_and_label(self):
        labels = [job["label"] for job in self.json_of("job", "list", "--state", "succeeded", "--label", "BAR")["jobs"]]
        self.assertIn("bar", labels)
        self.assertEqual(self.run_command("job", "list", "--state", "failed,cancelled", "--label", "bar"), "")
        self.assertIn("--state", self.daemon.command("job", "list", "--state", "lost", check=False).stderr)
        (self.folder / "watched.obj").write_bytes(meshes.obj(*meshes.box([1.02 * side for side in meshes.BAR_SIZE])))
        with subprocess.Popen([BIN / "carillon", "--json", "--server", self.daemon.server, "job", "watch", "--label",
                               "watched"], stdout=subprocess.PIPE, text=True) as watch:
            self.run_command("model", "create", self.folder / "watched.obj", "--material", meshes.MATERIAL, "--wait")
            self.run_command("model", "create", self.folder / "bar.obj", "--material", meshes.MATERIAL, "--label",
                             "other", "--wait")
            states = []
            while "JOB_STATE_SUCCEEDED" not in states:
                job = json.loads(watch.stdout.readline())
                self.assertEqual(job["label"], "watched")
                states.append(job["state"])
            watch.terminate()

    def test_the_doctor_finds_no_fault_with_a_daemon_and_says_what_to_do_without_one(self):
        healthy = self.daemon.command("doctor", check=False)
        self.assertEqual((healthy.returncode, healthy.stderr), (0, ""))
        subjects = ["carillond", "carillon.v1.AudioService", "carillon.v1.ModalModelService",
                    "carillon.v1.DecompositionService"]
        self.assertEqual([line.split()[:2] for line in healthy.stdout.splitlines()],
                         [["OK", subject] for subject in subjects])
        told = json.loads(self.daemon.command("doctor", "--json").stdout)
        self.assertEqual(told["fault_count"], 0)
        self.assertEqual([(found["verdict"], found["subject"]) for found in told["findings"]],
                         [("OK", subject) for subject in subjects])
        nobody = carillon("--server", f"unix:{self.folder}/nobody", "doctor")
        self.assertEqual(nobody.returncode, 3)
        self.assertRegex(nobody.stderr, "^carillon: SERVER_UNAVAILABLE: .*; start it there")

    def test_materials_are_listed_and_shown_with_their_source(self):
        self.assertRegex(self.run_command("material"), r"(?m)^bell_bronze +\d+ GPa +\d+ kg/m\^3$")
        self.assertRegex(self.run_command("material", "bell_bronze"), r"source +\w")
        unknown = self.daemon.command("material", "bell_bronce", check=False)
        self.assertRegex(unknown.stderr, "UNKNOWN_MATERIAL: .*bell_bronze")
        for words in (("list",), ("show", "oak")):
            self.assertIn("`carillon material` lists", self.daemon.command("material", *words, check=False).stderr)

    def test_scenes_are_listed_with_their_objects_and_deleted(self):
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        self.client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=scene, objects=[scene_service_pb2.NewObject(modal_model=self.model, material=MATERIAL, handle=5)]))
        listed = next(item for item in self.json_of("scene", "list")["scenes"] if item["name"] == scene)
        self.assertEqual((listed["object_count"], listed["gain"], listed["muted"]), (1, 1, False))
        self.assertRegex(self.run_command("scene", "list"), rf"(?m){scene}  1 object  gain 1  .*1 connection\n  5 ")
        self.run_command("scene", "delete", scene.removeprefix("scenes/"))
        self.assertNotIn(scene, self.run_command("scene", "list"))


class StatusTest(CommandLineTest):
    def test_the_status_has_the_mixer_and_the_version_limits_and_features(self):
        shown = self.json_of("status")
        self.assertEqual((shown["device"], shown["object_count"]), ("null", 0))
        server = shown["server"]
        self.assertEqual((server["version"], server["limits"]["scene_count"]), (carillon_package.__version__, 512))
        self.assertIn("decomposition", server["features"])
        text = self.run_command("status")
        self.assertRegex(text, r"(?m)^carillond \S+ at unix:.*\ndevice +null: 48000 Hz, 1 channel, ")
        self.assertRegex(text, r"(?m)^limits +512 scenes, ")


class VolumeTest(CommandLineTest):
    def test_the_volume_of_the_output_and_of_a_scene_is_changed_and_shown(self):
        self.assertEqual(self.run_command("volume", "--gain", "-6dB"), "output  gain 0.5012 (-6.0 dB)")
        self.assertEqual(self.run_command("volume", "--gain", "1", "--mute"), "output  gain 1 (+0.0 dB)  muted")
        self.assertEqual(self.run_command("volume", "--unmute"), "output  gain 1 (+0.0 dB)")
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        shown = self.json_of("volume", "--scene", scene.removeprefix("scenes/"), "--solo", "--gain", "2")
        self.assertEqual((shown["gain"], shown["solo"], shown["muted"]), (2, True, False))
        self.run_command("scene", "delete", scene)
        for words in (("--gain", "loud"), ("--gain", "-6"), ("--solo",), ("--gain",)):
            self.assertEqual(self.daemon.command("volume", *words, check=False).returncode, 2, words)
        self.assertIn("INVALID_SETTINGS", self.daemon.command("volume", "--gain", "2000", check=False).stderr)

    def test_a_recorded_stream_is_rendered_as_it_was_heard(self):
        with carillon_package.connect(self.daemon.server) as c, c.scene() as scene:
            bar = scene.add(self.model, meshes.MATERIAL)
            trace = self.folder / "live.contacts"
            recorder = subprocess.Popen([BIN / "carillon", "--server", self.daemon.server, "scene", "record",
                                         scene.name, "--out", trace], stderr=subprocess.PIPE, text=True)
            self.assertIn("waiting for a contact stream", recorder.stderr.readline())
            with c.recording(scene=scene.name) as heard:
                with scene.stream(step=0.01) as stream:
                    for i in range(5):
                        stream.step(0.01 * i, impacts=carillon_package.Impacts(
                            [bar], [(0, 0.008, 0.01)], [(0, 0, -0.002)], durations=1e-4))
                self.assertIn("5 steps", recorder.communicate()[1])
                live = heard.take(1.5)
            self.assertEqual(recorder.returncode, 0)
            rendered = c.render(trace, tail_s=0.3)
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
        (self.folder / names[0]).write_bytes(meshes.obj(*meshes.box((0.1, 0.01, 0.02))))
        (self.folder / names[1]).write_bytes(b"")
        table = self.folder / "table.jsonl"
        done = carillon("--server", self.daemon.server, "model", "create", *(self.folder / name for name in names),
                        "--material", meshes.MATERIAL, "--without-transfer", "--report", table)
        self.assertEqual(done.returncode, 1)
        self.assertIn("SOME_FAILED: 2 of 4 files", done.stderr)
        rows = [json.loads(line) for line in table.read_text().splitlines()]
        order = [row["index"] for row in rows]  # in which the jobs ended
        rows.sort(key=lambda row: row["index"])
        self.assertEqual([row["file"] for row in rows], [str(self.folder / name) for name in names])
        self.assertEqual([row["error"]["reason"] for row in rows[1::2]], ["MESH_EMPTY", "FILE_NOT_FOUND"])
        for row in rows[::2]:
            shown = self.json_of("model", "show", row["modal_model"])
            self.assertEqual((row["frequencies_hz"], row["t60_s"]), (shown["frequencies_hz"], shown["t60_s"]))
            self.assertGreater(row["node_count"], 0)
            self.assertEqual(row["warnings"], shown["header"]["warnings"])
            self.assertEqual(row["material"]["preset"], meshes.MATERIAL)
        self.assertEqual(rows[0]["label"], "gläserne Glocke 鐘")
        self.assertGreater(rows[0]["seconds"], 0)
        self.assertEqual(rows[2]["seconds"], 0)  # was there already
        unknown = carillon("--server", self.daemon.server, "--json", "model", "create",
                           *(self.folder / name for name in names), "--material", "oack")
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
        command = [BIN / "carillon", "--server", daemon.server, "model", "create", "--material", meshes.MATERIAL,
                   "--report", table, *(folder / f"{name}.obj" for name in ("slow", "open", "large"))]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as creation:
            creation.stdout.readline()  # the model of the repaired body; then its row is written
            while len(rows) < 2:
                rows = [json.loads(line) for line in table.read_text().splitlines()]
            jobs = json.loads(daemon.command("--json", "job", "list", "--state", "running,waiting").stdout)["jobs"]
            daemon.command("job", "cancel", "slow")
            creation.communicate(timeout=60)
        self.assertEqual([job["label"] for job in jobs], ["slow"])
        self.assertEqual(sorted(row["index"] for row in rows), [1, 2])
        of_file = {row["index"]: row for row in map(json.loads, table.read_text().splitlines())}
        self.assertGreater(of_file[1]["node_count"], 0)
        self.assertEqual([of_file[i]["error"]["reason"] for i in (0, 2)], ["JOB_CANCELLED", "MESH_UNIT_UNCLEAR"])

    def test_frequencies_and_t60_are_those_of_the_material(self):
        model = carillon_package.connect(self.daemon.server).model("bar")
        shown = self.json_of("model", "show", "bar")
        frequencies, decays = model.modes()
        numpy.testing.assert_allclose(shown["frequencies_hz"], numpy.hypot(frequencies, decays / (2 * math.pi)),
                                      rtol=1e-6)
        numpy.testing.assert_allclose(shown["t60_s"], math.log(1000) / decays, rtol=1e-6)
        undamped = self.json_of("model", "show", "bar", "--material", meshes.MATERIAL, "--loss-factor", "0", "--alpha1",
                                "0", "--alpha2", "0")
        self.assertEqual(set(undamped["t60_s"]), {None})

    def test_a_strike_is_written_to_a_file_and_not_played(self):
        for options, frames in ((("--seconds", "0.5"), 24000), ((), None)):
            file = self.folder / "ein Schlag.wav"
            told = self.json_of("strike", "bar", "--point", "0,0.008,0.005", "--impulse", "0,0,-0.01", "--out", file,
                                "--normalize", *options)
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
        self.assertEqual(self.json_of("scene", "list")["scenes"], [])

    def test_an_error_in_json_is_an_object(self):
        failed = carillon("--server", self.daemon.server, "--json", "model", "show", "nothing")
        self.assertEqual(failed.returncode, 1)
        self.assertEqual(json.loads(failed.stdout)["error"]["reason"], "MODAL_MODEL_NOT_FOUND")
        self.assertIn("carillon: MODAL_MODEL_NOT_FOUND", failed.stderr)


class JsonTest(CommandLineTest):
    def test_commands_that_write_a_file_say_in_json_what_they_wrote(self):
        example = self.json_of("example", "bar", "--out", self.folder / "json.obj")
        self.assertEqual((example["file"], example["material"]), (f"{self.folder}/json.obj", "maple"))
        self.assertIn("--impulse", example["strike"])
        block = self.json_of("example", "bar", "--size", "0.14,0.07,0.01", "--out", self.folder / "block.obj")
        corners = re.findall(r"(?m)^v (\S+) (\S+) (\S+)$", (self.folder / "block.obj").read_text())
        numpy.testing.assert_allclose(numpy.max(numpy.array(corners, float), 0), (0.14, 0.07, 0.01))
        self.assertIn("--point 0.07,0.035,0.01 ", block["strike"])
        exported = self.json_of("model", "export", "bar", "--out", self.folder / "json.npz")
        self.assertEqual(exported, {"file": f"{self.folder}/json.npz", "format": "npz", "modal_model": self.model})
        backup = self.folder / "json.db"
        self.assertEqual(self.json_of("db", "backup", backup),
                         {"file": str(backup), "byte_count": backup.stat().st_size})
        heard = self.json_of("listen", "--seconds", "0.2", "--out", self.folder / "json.wav")
        self.assertEqual(heard, {"file": f"{self.folder}/json.wav", "frame_count": 9600, "lost_frame_count": 0,
                                 "sample_rate_hz": 48000, "channel_count": 1, "peak": 0})
        self.assertEqual(len(sound.read_wave(self.folder / "json.wav")), 9600)


class RenderTest(CommandLineTest):
    def setUp(self):
        impulse = sound.impulse((0, 0.008, 0.010), (0, 0, -0.002), duration_s=1e-4)
        item = contact_trace_pb2.ContactTraceObject(handle=1, modal_model=self.model, material=MATERIAL)
        self.trace = self.folder / "trace.contacts"
        sound.write_trace(self.trace, [item], [contact_pb2.ContactStep(time_s=0, contacts=[impulse])])

    def render(self, *options):
        out = self.folder / "out.wav"
        self.run_command("render", self.trace, "--out", out, "--tail", 0.3, *options)
        return out

    def test_a_gain_in_decibels_is_the_same_for_a_file_and_for_a_strike(self):
        numpy.testing.assert_array_equal(sound.read_wave(self.render("--gain", "-20dB")),
                                         sound.read_wave(self.render("--gain", 0.1)))
        struck = [self.run_command("strike", "bar", "--point", "0,0.008,0.01", "--impulse", "0,0,-0.01", "--seconds",
                                   0.01, "--gain", gain) for gain in ("-20dB", 0.1)]
        self.assertEqual(*struck)

    def test_a_soft_sound_is_normalised_with_its_tail(self):
        plain = sound.read_wave(self.render("--normalize"))
        impulse = sound.impulse((0, 0.008, 0.010), (0, 0, -2e-8), duration_s=1e-4)
        item = contact_trace_pb2.ContactTraceObject(handle=1, modal_model=self.model, material=MATERIAL)
        sound.write_trace(self.trace, [item], [contact_pb2.ContactStep(time_s=0, contacts=[impulse])])
        shown = self.run_command("render", self.trace, "--out", self.folder / "faint.wav", "--tail", 0.6)
        self.assertIn("raise it by --gain or --normalize", shown)
        self.assertIn("below -70 LUFS", shown)
        soft = sound.read_wave(self.render("--normalize"))
        # Without the second rendering, the modes would end at a hundredth of the peak.
        numpy.testing.assert_allclose(soft, plain, atol=1e-4)

    def test_a_length_bounds_the_tail_that_is_rendered(self):
        with carillon_package.connect(self.daemon.server) as client:
            whole = client.render(self.trace).samples
            short = client.render(self.trace, longest_s=0.1).samples
        self.assertEqual(len(short), round(0.11 * sound.RATE))  # the last 10 ms fade out
        self.assertGreater(len(whole), 2 * len(short))
        numpy.testing.assert_array_equal(short[:4800], whole[:4800])

    def test_a_dash_writes_the_file_to_stdout(self):
        file = self.render().read_bytes()
        done = subprocess.run([BIN / "carillon", "--server", self.daemon.server, "render", self.trace, "--out", "-",
                               "--tail", "0.3"], capture_output=True, check=True)
        self.assertEqual(done.stdout, file)


class StrikeTest(CommandLineTest):
    def test_a_vector_is_one_word_or_three(self):
        for vectors in (("--point", "0,0.008,0.01", "--impulse", "0,0,-0.01"),
                        ("--point", "0", "0.008", "0.01", "--impulse", "0", "0", "-0.01")):
            struck = self.daemon.command("strike", "bar", *vectors, "--seconds", "0.01")
            self.assertRegex(struck.stdout, r"^\d+ modes: .* Hz, sounding by ")

    def test_it_prints_the_contact_and_the_peak_and_warns_of_a_distant_point(self):
        struck = self.daemon.command("strike", "bar", "--point", "0,0.008,0.01", "--impulse", "0,0,-0.01", "--duration",
                                     "0.002", "--seconds", "0.01")
        self.assertRegex(struck.stdout, r"contact of 2 ms, peak \S+ Pa at 1 m")
        self.assertNotIn("warning", struck.stderr)
        far = self.daemon.command("strike", "bar", "--point", "0,0.008,1", "--impulse", "0,0,-0.01", "--seconds",
                                  "0.01")
        self.assertIn("from the surface", far.stderr)
        refused = self.daemon.command("strike", "bar", "--point", "0,0.008,0.01", "--impulse", "0,0,-0.01",
                                      "--modes-only", "--seconds", "0.01", check=False)
        self.assertIn("TRANSFER_NOT_FOUND", refused.stderr)


class WithoutDaemonTest(unittest.TestCase):
    def test_a_command_or_an_option_that_is_not_there_names_the_nearest(self):
        for words, expected in ((("modal", "list"), "no command 'modal'; did you mean 'model'?"),
                                (("model", "lst"), "no command 'lst'; did you mean 'list'?"),
                                (("jbo", "list"), "no command 'jbo'; did you mean 'job'?"),
                                (("model", "create", "a.obj", "--materal", "oak"),
                                 "no option '--materal'; did you mean '--material'?"),
                                (("strike", "bell", "--point", "0,0,0", "--impulze", "0,0,1"),
                                 "no option '--impulze'; did you mean '--impulse'?"),
                                (("xyzzy",), "no command 'xyzzy'; run with --help for all")):
            done = carillon(*words)
            self.assertEqual(done.returncode, 2)
            self.assertEqual(done.stderr, f"carillon: there is {expected}\n")

    def test_a_wall_in_millimetres_is_understood(self):
        done = carillon("--server", "unix:/nonexistent", "model", "create", ROOT / "README.md", "--wall", "3mm")
        self.assertIn("SERVER_UNAVAILABLE", done.stderr)


if __name__ == "__main__":
    unittest.main()
