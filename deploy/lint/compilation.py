# SPDX-License-Identifier: Apache-2.0
"""The project's source files as a build compiles them, and a check of many at once that still names the one at fault.

Most of the time that clang needs for a file goes into the headers of libraries, so a checker gives it a few files in
one go.
"""

import json
import pathlib
import re
import shlex
import typing

# Few enough that a batch with a finding, which is checked again in halves, costs little.
MOST_IN_BATCH = 12
# Namespaces without a name, and in them a line that begins in the first column and defines something.
ANONYMOUS = re.compile(r"^namespace \{$.*?^\}  // namespace$", re.M | re.S)
DEFINED = re.compile(r"^(?!namespace\b|using namespace\b|TEST|INSTANTIATE)\w[\w:<>,&*\[\] ]*?(?<!:)\b(\w+)"
                     r"(?:\(|\[| =| final| :|\{| \{)", re.M)
INCLUDED = re.compile(r'^#include "(/[^"]+\.cc)"$', re.M)
# Options that name files of the build, each with its argument.
OF_THE_BUILD = ("-o", "-c", "-include")


class Source(typing.NamedTuple):
    name: str  # from the root of the project
    arguments: tuple  # of the compiler, without those that name files


def arguments_of(entry):
    words = iter(entry.get("arguments") or shlex.split(entry["command"]))
    next(words)  # the compiler
    for word in words:
        if word in OF_THE_BUILD:
            next(words)
        else:
            yield word


def compiled_by(entry, build):
    """The source files that an entry of the compilation database stands for. A file that CMake made to compile several
    as one includes them."""
    path = pathlib.Path(entry["directory"], entry["file"]).resolve()
    if not path.is_relative_to(build):
        return [path]
    if path.parent.name != "Unity":
        return []
    return [pathlib.Path(name) for name in INCLUDED.findall(path.read_text())]


def sources(root, build):
    """The project's own source files, sorted, each once."""
    found = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        for path in compiled_by(entry, build):
            if path.is_relative_to(root) and not path.is_relative_to(build):
                name = str(path.relative_to(root))
                found.setdefault(name, Source(name, tuple(arguments_of(entry))))
    return sorted(found.values())


def names_in(text):
    """The names that a file defines for itself alone, which may clash with those of another file."""
    return {name for part in ANONYMOUS.findall(text) for name in DEFINED.findall(part)}


def batches(root, given):
    """Lists of sources of one top-level folder that are compiled with the same arguments and define no name twice.
    Files of Highway, which include themselves, are each alone."""
    found = []
    for source in given:
        key = (source.name.partition("/")[0], source.arguments)
        names = names_in((root / source.name).read_text())
        alone = source.name.endswith(("_kernel.cc", "_kernels.cc"))
        for other_key, batch, taken in [] if alone else found:
            if other_key == key and len(batch) < MOST_IN_BATCH and not names & taken:
                # The build compiles them in ascending order; another order finds more of the missing includes.
                batch.insert(0, source)
                taken |= names
                break
        else:
            found.append((None if alone else key, [source], names))
    return [batch for _, batch, _ in found]


def text_of(root, batch):
    """A source file that is all files of a batch."""
    return "".join(f'#include "{root / source.name}"  // NOLINT: the checkers read files, not this one.\n'
                   for source in batch)


def findings(batch, check):
    """(source, text) of each source in which check() finds something. A batch in which it does is checked in halves,
    since names of two files may only clash."""
    text = check(batch)
    if not text:
        return []
    if len(batch) == 1:
        return [(batch[0], text)]
    middle = len(batch) // 2
    return findings(batch[:middle], check) + findings(batch[middle:], check)
