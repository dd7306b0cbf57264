# SPDX-License-Identifier: Apache-2.0
"""`carillon render FOLDER --out FOLDER`: the same bytes however many workers, shards and deaths there were.

CARILLON_CLIPS and CARILLON_CLIP_KILLS say how many clips and kills (200 and 20 are the whole campaign), CARILLON_SEED
repeats one.
"""

import contextlib
import hashlib
import json
import math
import os
import pathlib
import random
import signal
import subprocess
import tempfile

import numpy

import carillon
import meshes
import sound
from carillon.v1 import contact_pb2
from daemon import BIN, ROOT, DaemonTest, wait_until

CLIP_COUNT = int(os.environ.get("CARILLON_CLIPS", "12"))
KILL_COUNT = int(os.environ.get("CARILLON_CLIP_KILLS", "4"))
SEED = int(os.environ.get("CARILLON_SEED", "0")) or random.SystemRandom().getrandbits(32)


def contents(folder):
    """The digests of all files but those that begin with a dot."""
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in folder.rglob("*") if path.is_file() and not path.name.startswith(".")}


def manifest(folder):
    return [json.loads(line) for line in (folder / "manifest.jsonl").read_text().splitlines()]


def write_trace(model, path, number):
    """Two bars: one is struck by a named impulse, then the second strikes it as an engine would say."""
    rng = random.Random(number)
    trace = carillon.Trace(step=0.01, simulator="test", labels={"number": str(number), "Ort": "Köln"})
    left, right = (trace.add(model, meshes.MATERIAL, label=name, handle=handle)
                   for name, handle in (("left \"bar\"", 3), ("right", 7)))
    for step in range(8):
        contacts = carillon.Contacts(
            left, [(0.1, 0.005, 0.01)], [(0, 0, -0.01 * (number + 1))], second_objects=[right],
            second_points=[(0.1, 0.005, 0)]) if step == 4 else None
        at = (0.2 * rng.random(), 0.01, 0.01)
        impacts = carillon.Impacts(left, [at], [(0, 0, -0.02)]) if step == 0 else None
        trace.step(step * 0.01, contacts=contacts, impacts=impacts)
    trace.write(path)


class ClipsTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model = cls.c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL).name
        cls.traces = cls.folder / "traces"
        cls.traces.mkdir()
        for number in range(CLIP_COUNT):
            write_trace(cls.model, cls.traces / f"{number:03}.contacts", number)
        cls.whole = cls.folder / "whole"
        cls.render(cls.whole, "--stems", "--workers", 1)
        cls.expected = contents(cls.whole)

    def begin(self, out, *options, **pipes):
        """Starts the command for all traces."""
        words = ["--server", self.daemon.server, "render", self.traces, "--out", out, *map(str, options)]
        return subprocess.Popen([BIN / "carillon", *words], **pipes)

    @classmethod
    def render(cls, out, *options, traces=None, code=0):
        """Runs the command, which must end with the code."""
        run = cls.daemon.command("render", traces or cls.traces, "--out", out, *options, check=False)
        assert run.returncode == code, run
        return run

    def new_folder(self):
        return pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(dir=self.folder))) / "clips"

    def test_any_number_of_workers_and_shards_side_by_side_give_the_same_bytes(self):
        out = self.new_folder()
        shards = [self.begin(out, "--stems", "--workers", workers, "--shard", f"{i}/3")
                  for i, workers in ((1, 1), (2, 2), (3, 8))]
        self.assertEqual([shard.wait() for shard in shards], [0, 0, 0])
        self.assertEqual(contents(out), self.expected)

    def test_runs_killed_at_random_end_in_the_same_bytes(self):
        print(f"CARILLON_SEED={SEED}", flush=True)
        rng = random.Random(SEED)
        out = self.new_folder()
        for _ in range(KILL_COUNT):
            # Two at a time, one of which is killed: it must not take anything from the other.
            runs = [self.begin(out, "--stems", "--shard", f"{i}/2", stdout=subprocess.DEVNULL) for i in (1, 2)]
            victim = rng.choice(runs)
            with contextlib.suppress(subprocess.TimeoutExpired):
                victim.wait(rng.uniform(0.01, 0.05 * CLIP_COUNT))
            victim.send_signal(signal.SIGKILL)
            codes = [run.wait() for run in runs]
            self.assertEqual(codes[1 - runs.index(victim)], 0)
            for path in out.glob("*.json"):
                record = json.loads(path.read_text())
                self.assertEqual(hashlib.sha256((out / record["file"]).read_bytes()).hexdigest(), record["sha256"])
        self.render(out, "--stems")
        self.assertEqual(contents(out), self.expected)
        self.assertEqual(list(out.glob(".work-*")), [])

    def test_finished_clips_stay_and_damaged_ones_are_rendered_again(self):
        out = self.new_folder()
        self.render(out, "--stems")
        (out / "001.wav").write_bytes(b"RIFF")
        (out / "002.stems/7.wav").unlink()
        (out / "003.json").write_text("{}")
        before = (out / "004.wav").stat().st_mtime_ns
        printed = self.render(out, "--stems")
        self.assertIn("3 clips in ", printed.stdout)
        self.assertIn(f"{CLIP_COUNT - 3} there already", printed.stdout)
        self.assertEqual((out / "004.wav").stat().st_mtime_ns, before)
        self.assertEqual(contents(out), self.expected)

    def test_a_bad_trace_does_not_stop_the_others(self):
        traces, out = self.new_folder(), self.new_folder()
        traces.mkdir(parents=True)
        good = (self.traces / "000.contacts").read_bytes()
        (traces / "a.contacts").write_bytes(good)
        (traces / "b.contacts").write_bytes(good[:len(good) // 2])
        (traces / "c.contacts").write_bytes(b"")
        (traces / "d.contacts").mkdir()
        (traces / "e.contacts").write_bytes(good)
        failed = self.render(out, traces=traces, code=1)
        self.assertIn("SOME_FAILED: 3 clips", failed.stderr)
        lines = manifest(out)
        self.assertEqual([line["clip"] for line in lines], list("abcde"))
        self.assertEqual(["error" in line for line in lines], [False, True, True, True, False])
        self.assertEqual(lines[1]["error"]["reason"], "TRACE_MALFORMED")
        self.assertEqual((out / "a.wav").read_bytes(), (self.whole / "000.wav").read_bytes())
        # Once it is repaired, the next run takes it.
        (traces / "b.contacts").write_bytes(good)
        self.render(out, traces=traces, code=1)
        self.assertEqual((out / "b.wav").read_bytes(), (out / "a.wav").read_bytes())

    def test_the_manifest_tells_what_struck_what_when_where_and_how_hard(self):
        line = manifest(self.whole)[2]
        self.assertEqual(line["sha256"], self.expected[line["file"]])
        self.assertEqual([item["label"] for item in line["objects"]], ["left \"bar\"", "right"])
        struck, first, second = line["blows"]
        self.assertEqual((struck["object"], struck["time_s"]), (3, 0))
        self.assertNotIn("other_object", struck)
        numpy.testing.assert_allclose(struck["impulse_newton_seconds"], (0, 0, -0.02), rtol=1e-6)
        self.assertGreater(struck["duration_s"], 0)
        self.assertEqual([(blow["object"], blow["other_object"]) for blow in (first, second)], [(3, 7), (7, 3)])
        numpy.testing.assert_allclose(first["point_m"], (0.1, 0.005, 0.01), atol=1e-6)
        numpy.testing.assert_allclose(second["point_m"], (0.1, 0.005, 0), atol=1e-6)
        numpy.testing.assert_allclose(second["impulse_newton_seconds"], (0, 0, 0.03), rtol=1e-5)
        # The daemon sends a blow when the engine's contact is over.
        self.assertTrue(0.04 <= first["time_s"] <= 0.05)

    def test_clips_of_one_length_are_cut_or_followed_by_silence(self):
        out = self.new_folder()
        lengths = [line["seconds"] for line in manifest(self.whole)]
        length_s = sorted(lengths)[CLIP_COUNT // 2] - 0.001
        self.render(out, "--stems", "--length", length_s, "--fade", 0.02)
        frames = round(48000 * length_s)
        for line, before in zip(manifest(out), manifest(self.whole)):
            clip, whole = (sound.read_wave(folder / line["file"])[:, 0] for folder in (out, self.whole))
            self.assertEqual((len(clip), line["frame_count"]), (frames, frames))
            self.assertEqual(line["cut"], before["frame_count"] > frames)
            kept = min(frames - 960 if line["cut"] else frames, len(whole))
            numpy.testing.assert_array_equal(clip[:kept], whole[:kept])
            stems = [sound.read_wave(out / item["file"])[:, 0] for item in line["objects"]]
            self.assertTrue(all(numpy.abs(stem).max() > 0 for stem in stems))
            # Each file is rounded to 24 bits, and the tail of a stem that is below -80 dB may be left out.
            numpy.testing.assert_allclose(sum(stems), clip, atol=1.1e-4)

    def test_a_run_says_what_the_limiter_did_and_which_full_scale_suits_all(self):
        out = self.new_folder()
        loudest = max(line["peak_pa"] for line in manifest(self.whole))
        told = json.loads(self.render(out, "--full-scale-pa", loudest / 2, "--json").stdout)
        lines = manifest(out)
        limited = [line for line in lines if line["limited_frame_count"]]
        self.assertEqual(told["limited_clip_count"], len(limited))
        self.assertGreater(len(limited), 0)
        self.assertEqual(told["limited_frame_count"], sum(line["limited_frame_count"] for line in lines))
        printed = self.render(out, "--full-scale-pa", loudest / 2).stdout
        self.assertIn(f"--full-scale-pa {told['full_scale_for_all_pa']:.4g} suits all clips", printed)
        again = json.loads(self.render(out, "--full-scale-pa", told["full_scale_for_all_pa"], "--json").stdout)
        self.assertEqual((again["rendered"], again["limited_frame_count"]), (CLIP_COUNT, 0))

    def test_an_interrupted_run_ends_with_a_manifest_and_is_continued(self):
        out = self.new_folder()
        run = self.begin(out, "--stems", "--workers", 1, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        wait_until(lambda: list(out.glob("*.json")) or run.poll() is not None)
        run.send_signal(signal.SIGINT)
        self.assertIn("RENDERING_STOPPED", run.communicate()[1])
        self.assertEqual(run.returncode, 1)
        self.assertEqual([line["clip"] for line in manifest(out)], sorted(path.stem for path in out.glob("*.json")))
        self.assertEqual(list(out.glob(".work-*")), [])
        self.render(out, "--stems")
        self.assertEqual(contents(out), self.expected)

    def test_a_clip_may_be_normalized_and_needs_some_length_for_its_loudness(self):
        out = self.new_folder()
        self.render(out, "--normalize")
        for line in manifest(out):
            self.assertAlmostEqual(numpy.abs(sound.read_wave(out / line["file"])).max(), 0.9, places=4)
            self.assertIn("integrated_lufs", line)
        self.render(out, "--length", 0.3)
        self.assertTrue(all("integrated_lufs" not in line for line in manifest(out)))  # R 128 needs 0.4 s

    def write_bar(self, folder, name, *contacts, material=None):
        folder.mkdir(parents=True, exist_ok=True)
        trace = carillon.Trace(step=0.01)
        trace.add(self.model, material, handle=3)
        trace.steps.append(contact_pb2.ContactStep(contacts=contacts))
        trace.write(folder / f"{name}.contacts")

    def test_rejected_contacts_are_a_warning_and_an_error_where_nothing_else_sounds(self):
        traces, out = self.new_folder(), self.new_folder()
        point, blow = (0.1, 0.01, 0.01), (0, 0, -0.02)
        good, foreign = (sound.impulse(point, blow, handle) for handle in (3, 9))
        nowhere = sound.impulse((math.nan, 0, 0), blow, 3)
        for name, contacts in (("some", (good, foreign)), ("unknown", (foreign,)), ("nowhere", (nowhere, nowhere))):
            self.write_bar(traces, name, *contacts)
        failed = self.render(out, traces=traces, code=1)
        self.assertIn("SOME_FAILED: 2 clips", failed.stderr)
        self.assertIn("CONTACTS_REJECTED in 1 clip", failed.stdout)
        nowhere, some, unknown = manifest(out)
        self.assertEqual((nowhere["error"]["reason"], unknown["error"]["reason"]),
                         ("CONTACT_MALFORMED", "OBJECT_NOT_FOUND"))
        self.assertIn("all contacts were rejected (2)", nowhere["error"]["message"])
        self.assertEqual(some["rejected_count"], 1)
        warning, = some["warnings"]
        self.assertEqual((warning["id"], warning["count"]), ("CONTACTS_REJECTED", 1))
        self.assertIn("OBJECT_NOT_FOUND", warning["text"])
        one = self.daemon.command("render", traces / "unknown.contacts", "--out", self.folder / "one.wav", check=False)
        self.assertEqual(one.returncode, 1)
        self.assertIn("OBJECT_NOT_FOUND: nothing sounds", one.stderr)

    def test_a_clip_is_rendered_again_with_another_material_or_transfer(self):
        traces, out = self.new_folder(), self.new_folder()
        self.write_bar(traces, "bar", sound.impulse((0.1, 0.01, 0.01), (0, 0, -0.02), 3))
        self.write_bar(traces, "own", sound.impulse((0.1, 0.01, 0.01), (0, 0, -0.02), 3), material="brass")
        def run():
            told = json.loads(self.render(out, "--json", traces=traces).stdout)
            return told, [line["objects"][0] for line in manifest(out)], manifest(out)[0]["sha256"]
        self.addCleanup(self.daemon.command, "model", "tag", self.model, "--material", meshes.MATERIAL)
        self.daemon.command("model", "tag", self.model, "--material", "oak")
        told, (bar, own), first = run()
        self.assertEqual((told["rendered"], told["kept"]), (2, 0))
        self.assertEqual((bar["material"], own["material"]), ("oak", "brass"))
        self.assertEqual(bar["material_figures"]["young_pa"], self.c.materials["oak"].young_pa)
        self.assertEqual((bar["transfer"], own["transfer"]), (False, False))
        self.assertIn("2 clips with objects sounding by the paper's coupling", told["warnings"][0])
        self.daemon.command("model", "tag", self.model, "--material", "pine")
        told, (bar, own), second = run()
        self.assertEqual((told["rendered"], told["kept"], bar["material"]), (1, 1, "pine"))
        self.assertNotEqual(first, second)
        self.daemon.command("transfer", self.model, "--material", "pine", "--budget", 1, "--wait")
        told, (bar, own), third = run()
        self.assertEqual((told["rendered"], told["kept"]), (1, 1))
        self.assertEqual((bar["transfer"], own["transfer"]), (True, False))
        self.assertNotEqual(second, third)
        told, _, _ = run()
        self.assertEqual((told["rendered"], told["kept"]), (0, 2))

    def test_the_tasks_of_a_slurm_array_give_the_same_bytes(self):
        backup, out = self.folder / "backup.db", self.new_folder()
        self.daemon.command("db", "backup", backup)
        for task in ("1", "2"):
            subprocess.run([ROOT / "deploy/slurm/render_clips.sh", self.traces, out, backup, "--stems"], check=True,
                           env={**os.environ, "CARILLON_BIN": str(BIN), "SLURM_ARRAY_TASK_ID": task,
                                "SLURM_ARRAY_TASK_COUNT": "2"})
        self.assertEqual(contents(out), self.expected)

    def test_refusals(self):
        empty = self.new_folder()
        empty.mkdir(parents=True)
        self.assertIn("FILE_NOT_FOUND", self.render(self.new_folder(), traces=empty, code=1).stderr)
        self.render(self.new_folder(), "--shard", "0/3", code=2)
        self.render(self.new_folder(), "--shard", "4/3", code=2)
        self.render(self.new_folder(), "--workers", 9, code=2)
        blocked = self.render(self.traces / "000.contacts" / "out", code=1)
        self.assertIn("OUTPUT_NOT_WRITABLE", blocked.stderr)
