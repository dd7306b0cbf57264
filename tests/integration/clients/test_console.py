# SPDX-License-Identifier: Apache-2.0
"""The console against the real daemon: its gateway, and its page in Chromium, by the tests of console.test.js."""

import math
import os
import pathlib
import signal
import shutil
import subprocess
import tarfile
import threading
import time

import carillon
import meshes
from daemon import BIN, BUILD, ROOT, DaemonTest

# Of the bar in structural steel, whose speed of sound is sqrt(E/rho).
BAR_HZ = meshes.bar_first_bending_hz() * math.sqrt(2.1e11 / 7850 * meshes.DENSITY / meshes.YOUNG_PA)
HERE = pathlib.Path(__file__).resolve().parent


class ConsoleTest(DaemonTest):
    def setUp(self):
        super().setUp()
        self.bar = self.folder / "bar.obj"
        self.bar.write_bytes(meshes.bar())
        self.done = threading.Event()

    def start(self, command, *arguments):
        """Starts a program that prints the console's address, which the method returns with the process."""
        program = subprocess.Popen([BIN / command, *arguments], stdout=subprocess.PIPE, text=True)

        def stop():
            program.send_signal(signal.SIGTERM)
            self.assertEqual(program.wait(30), 0)
            program.stdout.close()

        self.addCleanup(stop)
        return program, program.stdout.readline().strip()

    def bundle_example(self):
        """Bundles the example for browsers with the package @carillon/web, as its pages say; returns their folder."""
        modules, pages = self.folder / "node_modules", self.folder / "pages"
        with tarfile.open(BUILD / "client_sdk/console/pages/carillon-web.tgz") as package:
            package.extractall(modules / "@carillon")
        web = (modules / "@carillon/package").rename(modules / "@carillon/web")
        (modules / "carillon").mkdir()  # the package for Node, of which the page needs the adapters alone
        (modules / "carillon/adapters").symlink_to(ROOT / "client_sdk/adapters")
        console, engines = os.environ["CARILLON_CONSOLE_MODULES"], os.environ["CARILLON_ENGINE_MODULES"]
        esbuild, = pathlib.Path(console).glob("@esbuild/linux-*/bin/esbuild")
        example = ROOT / "client_sdk/examples/browser"
        subprocess.run([esbuild, example / "main.js", "--bundle", "--format=esm", f"--outfile={pages}/main.js",
                        "--log-level=warning"], check=True,
                       env={**os.environ, "NODE_PATH": f"{modules}:{engines}:{console}"})
        shutil.copy(example / "index.html", pages)
        for name in ("listen_worker.js", "shared.js", "player_worklet.js"):
            shutil.copy(web / name, pages)
        return pages

    def write_trace(self):
        """Writes a trace of two bars that fly and are struck in turn, and its page, of which a label ends a script.

        Returns both files.
        """
        bar = self.c.create_model(self.bar, material="structural_steel")
        damped = carillon.material("structural_steel", loss_factor=0.02)  # each blow is over before the next
        for name, right in (("flight", "right"), ("page", "right</script>")):
            trace = carillon.Trace(step=0.1)
            handles = [trace.add(bar, damped, label=label) for label in ("left", right)]
            for step in range(10):
                impacts = carillon.Impacts(handles[step % 2], [[0, 0, 0]], [[0, 0, 0.02]])
                trace.step(step * 0.1, impacts=impacts if step < 6 else None,
                           poses=carillon.Poses(handles, [[0, 0.1 * step, 0], [0.5, -0.1 * step, 0]]))
            trace.write(self.folder / f"{name}.contacts")
        file, page = self.folder / "flight.contacts", self.folder / "flight.html"
        self.daemon.command("render", "--tail", "0.5", "--out", self.folder / "flight.wav", "--html", page,
                            self.folder / "page.contacts")
        return file, page

    def simulate(self):
        """Strikes three bars in a muted scene, in turn, until the test is done; goes on after the daemon's end."""
        while not self.done.is_set():
            try:
                with carillon.connect(self.daemon.server) as client, client.scene() as scene:
                    bar = client.create_model(self.bar, material="structural_steel")
                    bars = [scene.add(bar) for _ in range(3)]
                    scene.update(muted=True)
                    with scene.stream(step=0.1) as stream:
                        for step in range(100000):
                            if self.done.wait(0.1):
                                return
                            impact = carillon.Impacts(bars[step % 3], [[0, 0, 0]], [[0, 0, 0.02]])
                            poses = carillon.Poses(bars, [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]])
                            stream.step(step * 0.1, impacts=impact, poses=poses)
            except carillon.CarillonError:
                time.sleep(0.2)

    def restart(self):
        """Starts the daemon again when it has been killed."""
        self.daemon.process.wait()
        if not self.done.is_set():
            self.daemon.start()

    def test_the_tests_in_javascript_pass(self):
        console, address = self.start("carillon-console", "--server", self.daemon.server, "--port", "0")
        opened = self.folder / "open.obj"
        opened.write_bytes(b"\n".join(meshes.bar().splitlines()[:-1]) + b"\n")
        threads = [threading.Thread(target=work) for work in (self.simulate, self.restart)]
        for thread in threads:
            thread.start()
        example = self.start("carillon-console", "--server", self.daemon.server, "--port", "0", "--pages",
                             self.bundle_example())[1]
        trace, page = self.write_trace()
        environment = {**os.environ, "CARILLON_TEST_TRACE": str(trace), "CARILLON_TEST_PAGE": str(page),
                       "NODE_PATH": os.environ["CARILLON_CONSOLE_MODULES"], "CARILLON_CONSOLE": address,
                       "CARILLON_EXAMPLE": example.replace("/?", "/pages/?"),
                       "CARILLON_CONSOLE_PID": str(console.pid), "CARILLON_DAEMON_PID": str(self.daemon.process.pid),
                       "CARILLON_TEST_BAR": str(self.bar), "CARILLON_TEST_OPEN": str(opened),
                       "CARILLON_TEST_BAR_HZ": str(BAR_HZ), "CARILLON_TEST_PICTURES": str(self.folder)}
        try:
            done = subprocess.run(["node", "--test", HERE / "console.test.js"], env=environment, check=False,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=580)
        finally:
            self.done.set()
            self.daemon.process.terminate()
            for thread in threads:
                thread.join()
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertNotIn("# pass 0", done.stdout)

    def test_one_command_starts_the_daemon_and_the_console(self):
        os.environ["XDG_STATE_HOME"] = str(self.folder / "state")
        server = f"unix:{self.folder}/own/socket"
        program, address = self.start("carillon", "--server", server, "console", "--port", "0")
        self.assertRegex(address, r"^http://127.0.0.1:\d+/\?token=[0-9a-f]{64}$")
        status = subprocess.run([BIN / "carillon", "--server", server, "status"], capture_output=True, text=True,
                                check=False)
        self.assertEqual(status.returncode, 0, status.stderr)
        self.assertIsNone(program.poll())
