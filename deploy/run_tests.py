#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs ctest, and once more, alone, each test that failed or was skipped; a busy machine is the cause of some.

Usage: run_tests.py BUILD_FOLDER ARGUMENTS OF ctest...

The summary has the time of each room's tests, counts every test once, by its last run, and names those that were run
again. A test of the real-time path skips itself where the machine was too busy to judge, so one that is skipped in
both runs is named, too.
"""

import collections
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree as xml

# More failures than this are not the machine's.
MOST_RUN_AGAIN = 20


def room_of(test):
    """The folder of a test's file: server/scene of server/scene/scene_test.Scene.IsEmpty."""
    return test.split(".")[0].rpartition("/")[0] or test


def seconds_by_room(report):
    """A line with the time that the tests of each room took, longest first."""
    seconds = collections.Counter()
    for case in xml.parse(report).iter("testcase"):
        seconds[room_of(case.get("name"))] += float(case.get("time"))
    return "seconds of each room: " + ", ".join(f"{room} {time:.0f}" for room, time in seconds.most_common())


def run(arguments, report):
    """The state of each test that ctest ran: "run" where it passed, "fail" or "notrun" (skipped)."""
    report.unlink(missing_ok=True)
    code = subprocess.run(["ctest", "--output-junit", report, *arguments], check=False).returncode
    if not report.is_file():
        return {}, code
    return {case.get("name"): case.get("status") for case in xml.parse(report).iter("testcase")}, code


def exactly(names):
    return "^(" + "|".join(re.sub(r"([^\w/ ])", r"\\\1", name) for name in names) + ")$"


def summary(states, again):
    failed = sorted(name for name, state in states.items() if state == "fail")
    skipped = sorted(name for name, state in states.items() if state == "notrun")
    for title, names in (("run again alone", again), ("skipped", skipped), ("FAILED", failed)):
        if names:
            yield f"{len(names)} {title}: {', '.join(names)}"
    share = 100 * (len(states) - len(failed)) // max(len(states), 1)
    yield f"{share}% tests passed, {len(failed)} tests failed out of {len(states)}"


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    arguments = sys.argv[2:]
    states, code = run(arguments, folder / "tests.xml")
    again = sorted(name for name, state in states.items() if state in ("fail", "notrun"))
    if not states or len(again) > MOST_RUN_AGAIN:
        sys.exit(code or 1)
    times = seconds_by_room(folder / "tests.xml")
    if again:
        preset = arguments[arguments.index("--preset"):][:2] if "--preset" in arguments else []
        later, _ = run([*preset, "--parallel", "1", "--tests-regex", exactly(again)], folder / "tests_again.xml")
        states |= later
    print("\n".join(["", times, *summary(states, again)]))
    sys.exit(1 if "fail" in states.values() else 0)


if __name__ == "__main__":
    main()
