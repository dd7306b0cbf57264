# SPDX-License-Identifier: Apache-2.0
"""One run of carillon-precompute on a file, and what it took."""

import dataclasses
import json
import os
import subprocess
import tempfile
import threading
import time

import numpy


@dataclasses.dataclass
class Run:
    report: dict
    cpu_seconds: float
    wall_seconds: float
    peak_gib: float

    @property
    def verdict(self):
        """`model`, or the reason of the refusal."""
        return self.report["error"]["reason"] if "error" in self.report else "model"


def precompute(surface, arguments, options, environment, most_seconds, out=None):
    """Decomposes the file with these arguments; a run that takes longer is ended, and its reason is TIMEOUT. The
    model's file is kept where `out` names one."""
    with tempfile.TemporaryDirectory() as folder:
        command = [options.build / "bin/carillon-precompute", surface, "--out", out or os.path.join(folder, "model"),
                   "--json", *arguments]
        with tempfile.TemporaryFile("w+") as output:
            start = time.monotonic()
            child = subprocess.Popen([str(word) for word in command], stdout=output, stderr=subprocess.DEVNULL,
                                     env=environment)
            timer = threading.Timer(most_seconds, child.kill)
            timer.start()
            _, status, usage = os.wait4(child.pid, 0)
            timer.cancel()
            child.returncode = os.waitstatus_to_exitcode(status)
            wall = time.monotonic() - start
            output.seek(0)
            report = read_report(output.read(), child.returncode, wall >= most_seconds)
    return Run(report, usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 2**20)


def read_report(text, code, late):
    if late and code != 0:
        return {"error": {"reason": "TIMEOUT", "message": "the run was ended"}}
    try:
        report = json.loads(text)
    except ValueError:
        return {"error": {"reason": "CRASH", "message": f"exit code {code}, and no report"}}
    if code != 0 and "error" not in report:
        return {"error": {"reason": "CRASH", "message": f"exit code {code} after the report"}}
    return report


def column(report, name):
    """The value of each mode."""
    return numpy.array([mode[name] for mode in report["modes"]])
