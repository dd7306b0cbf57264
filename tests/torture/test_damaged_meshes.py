# SPDX-License-Identifier: Apache-2.0
"""carillon-precompute reads damaged mesh files: each ends with a model or a reason, in bounded time and memory.

CARILLON_TORTURE_COUNT and CARILLON_TORTURE_SEED choose how many files, and the first seed of their damage.
"""

import collections
import os
import pathlib
import random
import re
import resource
import subprocess
import sys
import unittest

import torture

PROGRAM = pathlib.Path(os.environ["CARILLON_BIN_DIR"]) / "carillon-precompute"
CORPORA = pathlib.Path(__file__).parent.parent / "fuzz" / "corpora"
# Bounds for one file. A body of a few triangles takes a second and 100 MiB.
LIMIT_S = 120
LIMIT_MIB = 1024
REFUSAL = re.compile(rb"carillon-precompute: ([A-Z][A-Z_]+): ", re.MULTILINE)
NUMBERS = (b"1e308", b"-1e308", b"nan", b"inf", b"1e-320", b"-1", b"0", b"2147483648", b"4294967295", b"1e9", b"")


def files():
    """(format, bytes) of every right file."""
    found = sorted(path for path in CORPORA.glob("mesh_*/*") if path.is_file())
    return [(path.parent.name.removeprefix("mesh_"), path.read_bytes()) for path in found]


def change_number(data, chance):
    numbers = list(re.finditer(rb"[-+]?[0-9.]+(e[-+]?[0-9]+)?", data))
    if not numbers:
        return data
    number = chance.choice(numbers)
    return data[:number.start()] + chance.choice(NUMBERS) + data[number.end():]


def change_bytes(data, chance):
    changed = bytearray(data)
    for _ in range(chance.choice((1, 1, 2, 8))):
        if changed:
            changed[chance.randrange(len(changed))] = chance.choice((0, 0x7f, 0x80, 0xff, chance.randrange(256)))
    return bytes(changed)


def move_part(data, chance):
    begin, end = sorted(chance.randrange(len(data) + 1) for _ in range(2))
    at = chance.randrange(len(data) + 1)
    return chance.choice((data[:begin] + data[end:], data[:at] + data[begin:end] + data[at:], data[:begin]))


def damaged(data, chance):
    for _ in range(chance.choice((1, 1, 2, 4))):
        data = chance.choice((change_number, change_bytes, move_part))(data, chance)
    return data


class DamagedMeshTest(torture.ScratchTest):
    def decompose(self, mesh_format, data, *options):
        """The reason of the refusal, or "MODEL"."""
        (self.folder / "in").write_bytes(data)
        command = [PROGRAM, "in", "--format", mesh_format, "--out", "out", "--material", "chime_aluminum",
                   "--keep", "4", "--nodes", "50", "--threads", "1", *options]
        ended = subprocess.run(command, cwd=self.folder, capture_output=True, timeout=LIMIT_S, check=False)
        if ended.returncode == 0:
            return "MODEL"
        reason = REFUSAL.search(ended.stderr)
        self.assertGreater(ended.returncode, 0, f"killed by a signal: {ended.stderr[-2000:]}")
        self.assertTrue(reason, ended.stderr[-2000:])
        return reason.group(1).decode()

    def test_a_surface_that_tetgen_refines_without_end_is_refused_soon(self):
        # Without the offset of its positions the file has the corners of no body; before, that took 100 s of processor
        # time.
        data = (CORPORA / "mesh_glb" / "binary").read_bytes().replace(b'"byteOffset":280', b'"bytxOffset":280')
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        self.assertEqual(self.decompose("glb", data, "--unit", "0.001"), "MESH_TETRAHEDRALIZATION_FAILED")
        self.assertLess(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, 50)

    def test_each_ends_with_a_model_or_a_reason(self):
        originals = files()
        self.assertGreater(len(originals), 10)
        ends = collections.Counter()
        first = int(os.environ.get("CARILLON_TORTURE_SEED", "0"))
        count = int(os.environ.get("CARILLON_TORTURE_COUNT", torture.rounds(60, 5_000)))
        for seed in range(first, first + count):
            chance = random.Random(seed)
            mesh_format, data = originals[seed % len(originals)]
            with self.subTest(seed=seed):
                ends[self.decompose(mesh_format, damaged(data, chance))] += 1
        mib = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024
        print(f"{count} damaged meshes: {dict(ends.most_common())}; at most {mib} MiB", file=sys.stderr)
        self.assertLess(mib, LIMIT_MIB)
        self.assertGreater(len(ends), 3)


if __name__ == "__main__":
    unittest.main()
