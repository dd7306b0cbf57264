# SPDX-License-Identifier: Apache-2.0
"""Each command of each page is one that the programs know: its words, options and values are right. A daemon, or the
files that a command names, need not be there."""

import os
import pathlib
import re
import shlex
import subprocess
import tempfile
import unittest

from daemon import BIN, ROOT

BLOCK = re.compile(r"(?ms)^```sh\n(.*?)^```|^((?:    [^\n]*\n)+)")
FENCED = re.compile(r"(?ms)^```.*?^```|^    [^\n]*$")
CALL = re.compile(r"(?:^|\$\(|-- |do |sudo )(carillon(?:d|-precompute)? [^|>&;)#\n]*)", re.MULTILINE)
WORDS = re.compile(r"`(carillon(?:d|-precompute)?\s[^`]+)`")
WRONG = re.compile("there is no (?:option|command)|not expected")
# What a page says of a folder of the system.
PLACES = re.compile(r"/var/lib/carillon|/tmp/old|/srv/backup")


def pages():
    for pattern in ("*.md", "docs/*.md", "docs/sounds/*.md", "client_sdk/*/README.md"):
        yield from sorted(ROOT.glob(pattern))


def commands():
    """(page, command, whether it is whole) of each page but the changelog, which tells of older commands, too."""
    for page in pages():
        if page.name != "CHANGELOG.md":
            text = page.read_text()
            for fenced, indented in BLOCK.findall(text):
                block = (fenced or re.sub("(?m)^    ", "", indented)).replace("\\\n", " ")
                yield from ((page, call, True) for call in CALL.findall(block))
            yield from ((page, " ".join(call.split()), False) for call in WORDS.findall(FENCED.sub("", text)))


class PagesTest(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="carillon-"))
        pathlib.Path(self.folder, "traces").mkdir()  # clips.md has it
        self.environment = {**os.environ, "CARILLON_SERVER": "unix:/nowhere", "HOME": self.folder}

    def run_command(self, command):
        program, *words = shlex.split(PLACES.sub(self.folder, command))
        if program == "carillond" and "db" not in words:
            words.insert(0, "--check-config")
        if words[:1] == ["console"]:
            words.append("--help")  # it would go on until it is stopped
        return subprocess.run([BIN / program, *words], cwd=self.folder, env=self.environment, check=False,
                              capture_output=True, text=True, timeout=60)

    def test_every_command_is_known(self):
        found = [command for command in commands() if "[" not in command[1] and "..." not in command[1]]
        self.assertGreater(len(found), 100)
        for page, command, is_whole in found:
            with self.subTest(page=str(pathlib.Path(page).relative_to(ROOT)), command=command):
                done = self.run_command(command)
                self.assertNotRegex(done.stderr, WRONG)
                if is_whole:
                    self.assertNotEqual(done.returncode, 2, done.stderr)


if __name__ == "__main__":
    unittest.main()
