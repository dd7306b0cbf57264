# SPDX-License-Identifier: Apache-2.0
"""Each command of each page is one that the programs know: its words, options and values are right. A daemon, or the
files that a command names, need not be there. The first pages are typed as printed, and heard."""

import os
import pathlib
import re
import shlex
import subprocess

import carillon
import numpy
import sound
from daemon import BIN, ROOT, ScratchTest

BLOCK = re.compile(r"(?ms)^ *```sh\n(.*?)^ *```|^((?:    [^\n]*\n)+)")
FENCED = re.compile(r"(?ms)^```.*?^```|^    [^\n]*$")
CALL = re.compile(r"(?:^|\$\(|-- |do |sudo )(carillon(?:d|-precompute)? [^|>&;)#\n]*)", re.MULTILINE)
WORDS = re.compile(r"`(carillon(?:d|-precompute)?\s[^`]+)`")
WRONG = re.compile("there is no (?:option|command)|not expected")
SCRIPT = re.compile(r"\./(deploy/\w+\.sh)(?: ([a-z]\w*(?:/\w+)*))?\b")
# Where the word is that a script is given.
GIVEN = {"bench": ["tests/benchmarks/{}/run.py"], "setup": ["deploy/packages/{}.txt"], "test": ["tests/{}*", "{}.sh"]}
BELL_HZ = 1004.6  # as docs/ten_minutes_python.md says
# What a page says of a folder of the system.
PLACES = re.compile(r"/var/lib/carillon|/tmp/old|/srv/backup")


def pages():
    for pattern in ("*.md", "docs/*.md", "docs/sounds/*.md", "proto/*.md", "client_sdk/**/*.md"):
        yield from (page for page in sorted(ROOT.glob(pattern)) if "node_modules" not in page.parts)


def blocks(page):
    for fenced, indented in BLOCK.findall(page.read_text()):
        yield re.sub("(?m)^ +", "", fenced or indented).replace("\\\n", " ")


def commands():
    """(page, command, whether it is whole) of each page but the changelog, which tells of older commands, too."""
    for page in pages():
        if page.name != "CHANGELOG.md":
            for block in blocks(page):
                yield from ((page, call, True) for call in CALL.findall(block))
            yield from ((page, " ".join(call.split()), False)
                        for call in WORDS.findall(FENCED.sub("", page.read_text())))


class PagesTest(ScratchTest):
    def setUp(self):
        super().setUp()
        (self.folder / "traces").mkdir()  # clips.md has it
        self.environment = {**os.environ, "CARILLON_SERVER": "unix:/nowhere", "HOME": str(self.folder)}

    def run_command(self, command):
        program, *words = shlex.split(PLACES.sub(str(self.folder), command))
        if program == "carillond" and "db" not in words:
            words.insert(0, "--check-config")
        if words[:1] == ["console"]:
            words.append("--help")  # it would go on until it is stopped
        return subprocess.run([BIN / program, *words], cwd=self.folder, env=self.environment, check=False,
                              capture_output=True, text=True, timeout=300)

    def test_every_command_is_known(self):
        found = [command for command in commands() if "[" not in command[1] and "..." not in command[1]]
        self.assertGreater(len(found), 100)
        for page, command, is_whole in found:
            with self.subTest(page=str(pathlib.Path(page).relative_to(ROOT)), command=command):
                done = self.run_command(command)
                self.assertNotRegex(done.stderr, WRONG)
                if is_whole:
                    self.assertNotEqual(done.returncode, 2, done.stderr)

    def test_every_script_and_what_it_is_given_is_there(self):
        found = [(page, *call) for page in pages() for call in SCRIPT.findall(page.read_text())]
        self.assertGreater(len(found), 40)
        for page, script, word in found:
            with self.subTest(page=str(page.relative_to(ROOT)), script=script, word=word):
                self.assertTrue(os.access(ROOT / script, os.X_OK))
                if word and (places := GIVEN.get(pathlib.Path(script).stem)):
                    self.assertTrue(any(any(ROOT.glob(place.format(word))) for place in places))

    def test_the_first_pages_are_heard_as_printed(self):
        self.serve()
        server = self.daemon.server
        environment = {**self.environment, "CARILLON_SERVER": server, "PATH": f"{BIN}:{os.environ['PATH']}"}
        with carillon.connect(server) as c, c.recording() as heard:
            for page in ("README.md", "docs/sounds/README.md"):
                block = next(text for text in blocks(ROOT / page) if "carillon strike" in text)
                subprocess.run(["bash", "-euc", block], cwd=self.folder, env=environment, check=True)
            heard.take(0.5)
        self.assertAlmostEqual(heard.sound.loudest_frequency_hz(), BELL_HZ, delta=BELL_HZ / 100)
        self.assertAlmostEqual(numpy.abs(sound.read_wave(self.folder / "bell_steel.wav")).max(), 1,
                               delta=0.2)
