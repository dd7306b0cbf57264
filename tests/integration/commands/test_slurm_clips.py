# SPDX-License-Identifier: Apache-2.0
"""A folder of traces, rendered on ten nodes of Slurm and by one worker: the same bytes.

CARILLON_CLIPS says how many clips; 200 are the whole campaign. Skipped where no cluster can be started.
"""

import pathlib
import subprocess
import tempfile
import time
import unittest

import carillon
import meshes
from daemon import BIN, ROOT, DaemonTest
from test_clips import CLIP_COUNT, contents, write_trace
from test_slurm import Cluster

NODE_COUNT = 10


class SlurmClipsTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-slurm-")
        cls.addClassCleanup(scratch.cleanup)
        cluster = Cluster(pathlib.Path(scratch.name), NODE_COUNT)
        cls.addClassCleanup(cluster.run, "stop")
        if not cluster.start():
            raise unittest.SkipTest("no Slurm cluster can be started here")
        super().setUpClass()

    def test_ten_nodes_give_the_bytes_of_one_worker(self):
        traces, alone, shared = (self.folder / name for name in ("traces", "alone", "shared"))
        traces.mkdir()
        with carillon.connect(self.daemon.server) as client:
            model = client.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL).name
        for number in range(CLIP_COUNT):
            write_trace(model, traces / f"{number:03}.contacts", number)
        begin_s = time.monotonic()
        self.daemon.command("render", traces, "--out", alone, "--stems", "--workers", 1)
        alone_s = time.monotonic() - begin_s
        self.daemon.command("db", "backup", self.folder / "models.db")
        begin_s = time.monotonic()
        done = subprocess.run(
            ["sbatch", "--wait", f"--array=1-{NODE_COUNT}", "--mem=200M", "--cpus-per-task=2",
             f"--output={self.folder}/task-%a.log", f"--export=ALL,CARILLON_BIN={BIN}",
             ROOT / "deploy/slurm/render_clips.sh", traces, shared, self.folder / "models.db", "--stems"],
            capture_output=True, text=True, check=False, timeout=300)
        logs = [log.read_text() for log in sorted(self.folder.glob("task-*.log"))]
        self.assertEqual(done.returncode, 0, [done.stderr, *logs])
        self.assertEqual(len(logs), NODE_COUNT)
        self.assertEqual(contents(shared), contents(alone))
        print(f"{CLIP_COUNT} clips by one worker in {alone_s:.1f} s, on {NODE_COUNT} nodes of this machine in "
              f"{time.monotonic() - begin_s:.1f} s: the same bytes", flush=True)


if __name__ == "__main__":
    unittest.main()
