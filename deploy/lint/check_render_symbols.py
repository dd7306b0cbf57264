#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that nothing which the compiled Mixer::Render can reach calls what a rendering thread must not.

Walks from the roots over every call, jump and address in the archives' machine code; of the functions outside
them, only those that are listed here may be reached. What is called through a table of pointers, as the kernels of
each SIMD target are, counts as reached with the table.

Usage: check_render_symbols.py ARCHIVE...
"""

import collections
import re
import subprocess
import sys

ROOT = r"carillon::Mixer::Render\("
ALLOWED = [
    r"mem(cpy|move|set|cmp)", r"_GLOBAL_OFFSET_TABLE_",
    r"(sqrt|hypot|atan2|exp2?|sincos|lrint|round|floor|ceil|pow|fma)f?", r"kiss_fftri",
    # A mistake of ours or a failed assertion: the program ends, which needs no deadline.
    r"std::terminate\(\)", r"__assert_fail", r"__stack_chk_fail", r"_Unwind_Resume", r"__gxx_personality_v0",
    r"__cxa_(begin|end)_catch", r"std::__glibcxx_assert_fail.*", r"__clang_call_terminate", r"DW\.ref\..*",
    # Arithmetic with quaternions (server/base/pose.cc).
    r"carillon::(Normalized|Inverse|Rotated)\(.*\)",
    # The clock, which the kernel maps into the process: no system call.
    r"std::chrono::_V2::steady_clock::now\(\)",
    # Which SIMD target is there, asked once: the processor only.
    r"hwy::(GetChosenTarget|SupportedTargets)\(\)",
    r"__tls_get_addr",
]
SYMBOL = re.compile(r"^([0-9a-f]{16}) (.{7}) (\S+)\s+([0-9a-f]{16}) (?:\.hidden )?(.*)$")
RELOCATION = re.compile(r"^\s*([0-9a-f]+):?\s+R_\w+\s+(.*?)([+-]0x[0-9a-f]+)?$")
NEAR = re.compile(r"^\s+[0-9a-f]+:\s.*<([^>+]+)(?:\+0x[0-9a-f]+)?>$")


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


class Archive:
    """What refers to what: nodes are symbols, or "object section" for data that has none."""

    def __init__(self, paths):
        self.edges = collections.defaultdict(set)
        self.defined = set()
        self.placed = collections.defaultdict(list)  # (object, section): (start, size, symbol)
        self._read_symbols(paths)
        self._read_code(paths)
        self._read_data(paths)

    def _read_symbols(self, paths):
        member = ""
        for line in run("objdump", "-t", *paths).splitlines():
            if ":     file format" in line:
                member = line.split(":")[0]
            match = SYMBOL.match(line)
            if not match or match[3] in ("*UND*", "*ABS*") or "d" in match[2]:
                continue
            name = self._local(member, match[5], match[2])
            self.placed[member, match[3]].append((int(match[1], 16), int(match[4], 16), name))
            self.defined.add(name)

    @staticmethod
    def _local(member, name, flags):
        return f"{member} {name}" if flags.startswith("l") else name

    def _at(self, member, section, offset):
        for start, size, name in self.placed[member, section]:
            if start <= offset < start + max(size, 1):
                return name
        return f"{member} {section}"

    def _target(self, member, text, addend):
        if (member, text) in self.placed and f"{member} {text}" not in self.defined:
            return self._at(member, text, addend)
        local = f"{member} {text}"
        return local if local in self.defined else text

    def _read_code(self, paths):
        member = function = ""
        for line in run("objdump", "-dr", "--no-show-raw-insn", *paths).splitlines():
            if ":     file format" in line:
                member = line.split(":")[0]
            elif line.endswith(">:"):
                function = self._target(member, line[line.index("<") + 1:-2], 0)
            elif match := RELOCATION.match(line):
                addend = int(match[3] or "0", 16)
                # Relative to the next instruction: four bytes further.
                near = addend + (4 if "PC32" in line or "PLT32" in line else 0)
                self.edges[function].add(self._target(member, match[2].strip(), near))
            elif match := NEAR.match(line):
                self.edges[function].add(self._target(member, match[1], 0))

    def _read_data(self, paths):
        member = section = ""
        for line in run("objdump", "-r", *paths).splitlines():
            if ":     file format" in line:
                member = line.split(":")[0]
            elif line.startswith("RELOCATION RECORDS FOR"):
                section = line[line.index("[") + 1:line.index("]")]
            elif section.startswith((".data", ".rodata", ".init_array")):
                if match := RELOCATION.match(line):
                    target = self._target(member, match[2].strip(), int(match[3] or "0", 16))
                    for node in (self._at(member, section, int(match[1], 16)), f"{member} {section}"):
                        self.edges[node].add(target)


def forbidden(paths):
    """Each symbol that may not be reached, with the way to it."""
    archive = Archive(paths)
    names = sorted(archive.defined | set(archive.edges))
    plain = dict(zip(names, run("c++filt", *names).splitlines())) if names else {}
    roots = [name for name in names if re.search(ROOT, plain[name])]
    if not roots:
        yield f"{' '.join(paths)}: no function matches {ROOT}"
    before = dict.fromkeys(roots)
    queue = list(roots)
    while queue:
        node = queue.pop()
        for target in archive.edges[node]:
            if target not in before:
                before[target] = node
                queue.append(target)
    outside = [name for name in before if name not in archive.defined and " " not in name
               and not name.startswith(".")]
    for name, pretty in zip(outside, run("c++filt", *outside).splitlines() if outside else []):
        if any(re.fullmatch(allowed, pretty) for allowed in ALLOWED):
            continue
        way, node = [], name
        while node is not None:
            way.append(plain.get(node, pretty if node == name else node))
            node = before[node]
        yield f"{pretty} is reached: " + " <- ".join(way)


def main():
    problems = list(forbidden(sys.argv[1:]))
    for problem in problems:
        print(problem)
    print(f"{len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
