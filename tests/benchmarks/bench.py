# SPDX-License-Identifier: Apache-2.0
"""What the benchmarks share: the programs of a build, and tables in Markdown."""

import argparse
import contextlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def names(text):
    return text.split(",")


def parser(text):
    """A parser with the argument that every benchmark has."""
    made = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--build", type=lambda folder: pathlib.Path(folder).resolve(), default=ROOT / "build/release",
                      help="the release build's folder")
    return made


def use(build, *folders):
    """Lets modules of these folders be imported, those of the client for Python, and those of tests/integration, which
    start the programs of the build. Returns the folders of modules."""
    found = [str(build / "client_sdk/python"),
             *(str(ROOT / folder) for folder in ("client_sdk/python", "tests/integration", *folders))]
    sys.path[:0] = found
    os.environ.update(CARILLON_BIN_DIR=str(build / "bin"), CARILLON_BUILD_DIR=str(build))
    return found


@contextlib.contextmanager
def daemon(*arguments):
    """A daemon in a folder of its own. It needs `use` before."""
    from daemon import Daemon
    with tempfile.TemporaryDirectory(prefix="carillon-") as folder:
        started = Daemon(folder, *arguments)
        try:
            yield started
        finally:
            started.stop()


def cpu_s(pid):
    """CPU seconds of a process so far."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def decompose(build, mesh, out, *options):
    """The report of carillon-precompute. Ends the benchmark if there is no model."""
    command = [build / "bin/carillon-precompute", mesh, "--out", out, "--json", *options]
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          check=False)
    report = json.loads(done.stdout)
    if "error" in report:
        sys.exit(f"{mesh}: {report['error']}")
    return report


def pyplot():
    """The module of Matplotlib, which draws into files alone."""
    os.environ.setdefault("MPLCONFIGDIR", tempfile.gettempdir())
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot as module
    return module


def row(*cells):
    return f"| {' | '.join(map(str, cells))} |"


def head(*columns):
    return [row(*columns), row(*["---"] * len(columns))]


def print_row(*cells):
    print(row(*cells), flush=True)


def print_head(*columns):
    print(*head(*columns), sep="\n", flush=True)
