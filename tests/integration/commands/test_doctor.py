# SPDX-License-Identifier: Apache-2.0
"""`carillon doctor` and `carillon health` where a part of the daemon does not serve, and where a program of another
user sits at the socket."""

import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time
import unittest

from daemon import BIN, Daemon


class HealthTest(unittest.TestCase):
    MODELS = "carillon.v1.ModalModelService"
    DECOMPOSITIONS = "carillon.v1.DecompositionService"

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="carillon-")))
        self.precompute = self.folder / "precompute"
        shutil.copy("/bin/true", self.precompute)
        self.daemon = Daemon(self.folder, "--precompute", self.precompute)
        self.addCleanup(self.daemon.stop)

    def wait_until_not_serving(self, service):
        end_s = time.monotonic() + 30
        while self.daemon.health(service) != "NOT_SERVING":
            self.assertLess(time.monotonic(), end_s, service)
            time.sleep(0.05)

    def findings(self, verdict="FAULT"):
        """The texts of the doctor's findings with this verdict, by their subject."""
        told = json.loads(self.daemon.command("doctor", "--json", check=False).stdout)
        return {found["subject"]: found["text"] for found in told["findings"] if found["verdict"] == verdict}

    def test_health_prints_each_service_and_succeeds_only_if_all_serve(self):
        serving = self.daemon.command("health", check=False)
        self.assertEqual((serving.returncode, serving.stderr), (0, ""))
        self.assertEqual([line.split() for line in serving.stdout.splitlines()],
                         [[name, "SERVING"] for name in
                          ("carillond", "carillon.v1.AudioService", self.MODELS, self.DECOMPOSITIONS)])
        self.precompute.unlink()
        self.wait_until_not_serving(self.DECOMPOSITIONS)
        without = self.daemon.command("health", check=False)
        self.assertEqual(without.returncode, 1)
        self.assertRegex(without.stdout, rf"(?m)^{self.DECOMPOSITIONS} +NOT_SERVING$")
        self.assertRegex(without.stdout, rf"(?m)^{self.MODELS} +SERVING$")
        self.assertRegex(without.stderr, f"^carillon: NOT_SERVING: .*`carillon doctor`.* {self.DECOMPOSITIONS}\n$")
        told = self.daemon.command("health", "--json", check=False)
        self.assertEqual((told.returncode, json.loads(told.stdout)),
                         (1, {"serving": ["carillond", "carillon.v1.AudioService", self.MODELS],
                              "not_serving": [self.DECOMPOSITIONS]}))

    def test_health_and_doctor_find_a_folder_of_decompositions_that_cannot_be_used(self):
        work = self.folder / "data/work"
        work.rmdir()
        work.write_text("not a folder")
        self.wait_until_not_serving(self.DECOMPOSITIONS)
        self.assertRegex(self.findings()[self.DECOMPOSITIONS], "^is NOT_SERVING: .*folder work")
        self.assertRegex((self.folder / "log").read_text(), "decompositions_impossible error=.WORK_FOLDER_UNUSABLE: "
                         f"{work}, .*remove the file in place of the folder")
        work.unlink()
        end_s = time.monotonic() + 30
        while self.daemon.health(self.DECOMPOSITIONS) != "SERVING":
            self.assertLess(time.monotonic(), end_s)
            time.sleep(0.05)

    def test_the_doctor_checks_the_settings_with_the_environment_of_the_daemon(self):
        self.daemon.stop()
        file = self.folder / "carillond.toml"
        file.write_text("workers = 1\n")
        self.daemon.environment = {**os.environ, "CONFIGURATION_DIRECTORY": str(self.folder)}
        self.daemon.start()
        self.assertIn("settings", self.findings("OK"))
        file.write_text("workers = 1\nlog_level = \"a\\u001b[2K\\rok  settings\"\n")
        found = self.findings()["settings"]
        self.assertRegex(found, f"would not start again: INVALID_CONFIGURATION: {file}.*log_level")
        self.assertNotIn("\x1b", found)

    @unittest.skipIf(os.geteuid() != 0, "only root can be another user")
    def test_the_doctor_of_root_executes_no_program_of_another_user(self):
        """Among these is a process of that user with the set-user-ID bit, whose effective user is root."""
        proof = self.folder / "proof"
        self.folder.chmod(0o755)
        for name, mode in (("other", 0o755), ("setuid", 0o4755)):
            with self.subTest(name=name):
                program = self.folder / name / "carillond"
                program.parent.mkdir()
                # It listens, and would prove that somebody else has executed it.
                subprocess.run(["cc", "-x", "c", "-o", program, "-"], check=True, text=True, input=f"""
                    #include <fcntl.h>
                    #include <string.h>
                    #include <sys/socket.h>
                    #include <sys/un.h>
                    #include <unistd.h>
                    int main(int count, char **words) {{
                      if (count > 1) return close(creat("{proof}", 0600));
                      struct sockaddr_un name = {{AF_UNIX, "{program.parent}/socket"}};
                      int made = socket(AF_UNIX, SOCK_STREAM, 0);
                      bind(made, (struct sockaddr *)&name, sizeof name);
                      listen(made, 9);
                      write(1, "\\n", 1);
                      while (1) send(accept(made, 0, 0), "x", 1, MSG_NOSIGNAL);
                    }}""")
                program.chmod(mode)
                program.parent.chmod(0o777)
                impostor = self.enterContext(subprocess.Popen(
                    ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", program], stdout=subprocess.PIPE))
                self.addCleanup(impostor.kill)
                self.assertEqual(impostor.stdout.readline(), b"\n")
                told = subprocess.run([BIN / "carillon", "--server", f"unix:{program.parent}/socket", "doctor"],
                                      capture_output=True, text=True, check=False, timeout=120)
                self.assertRegex(told.stdout, r"(?m)^UNKNOWN +settings +run this as the daemon's user")
                self.assertFalse(proof.exists())

    def test_the_doctor_finds_a_database_that_was_moved_away(self):
        (self.folder / "data/carillon.db").rename(self.folder / "data/away.db")
        self.wait_until_not_serving(self.MODELS)
        self.assertEqual(set(self.findings()), {self.MODELS, self.DECOMPOSITIONS})


if __name__ == "__main__":
    unittest.main()
