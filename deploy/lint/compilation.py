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
MOST_IN_BATCH = 16
# Namespaces without a name, and in them a line that begins in the first column and defines something.
ANONYMOUS = re.compile(r"^namespace \{$.*?^\}  // namespace$", re.M | re.S)
DEFINED = re.compile(r"^(?!namespace\b|using namespace\b|TEST|INSTANTIATE)\w[\w:<>,&*\[\] ]*?(?<!:)\b(\w+)"
                     r"(?:\(|\[| =| final| :|\{| \{)", re.M)
# Functions of which each program has its own.
OF_A_PROGRAM = re.compile(r'^(?:extern "C" )?int (main|LLVMFuzzer\w+)\(|^BENCHMARK_(MAIN)\(', re.M)
INCLUDED = re.compile(r'^#include "(/[^"]+\.cc)"$', re.M)
# Options that name files of the build, each with its argument.
OF_THE_BUILD = ("-o", "-c", "-include")
# Options that change the code that the compiler generates, and nothing that a checker sees.
OF_THE_CODE = re.compile(r"-O\w*|-g\d?|-pthread|-f(PIC|PIE|no-omit-frame-pointer|(no-)?sanitize.*)|"
                         r"-Wno-subobject-linkage")


class Source(typing.NamedTuple):
    name: str  # from the root of the project
    arguments: tuple  # of the compiler, without those that name files


def arguments_of(entry):
    words = iter(entry.get("arguments") or shlex.split(entry["command"]))
    next(words)  # the compiler
    for word in words:
        if word in OF_THE_BUILD:
            next(words)
        elif not OF_THE_CODE.fullmatch(word):
            yield word


class Arguments:
    """The arguments of a compiler in three kinds: the folders of headers, the macros, and the others."""

    def __init__(self, words):
        self.folders, self.macros, self.others = {}, {}, []
        words = iter(words)
        for word in words:
            if word == "-isystem":
                self.folders[word, next(words)] = True
            elif word.startswith("-I"):
                self.folders[word,] = True
            elif word.startswith("-D"):
                name, _, value = word.partition("=")
                self.macros[name] = "=" + value if value else ""
            else:
                self.others.append(word)

    def fits(self, other):
        """Whether the files of both may be compiled together. Macros whose value is a text may differ."""
        return self.others == other.others and all(
            other.macros.get(name, value) == value or value.startswith('="') for name, value in self.macros.items())

    def add(self, other):
        self.folders = {**self.folders, **other.folders}
        self.macros = {**other.macros, **self.macros}

    def words(self):
        return [*self.others, *(name + value for name, value in self.macros.items()),
                *(word for folder in self.folders for word in folder)]


def arguments(batch):
    """The arguments with which all files of a batch compile: the folders of headers and the macros of all of them."""
    common = Arguments(batch[0].arguments)
    for source in batch[1:]:
        common.add(Arguments(source.arguments))
    return common.words()


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
    """The names that a file defines for itself or for its program, which may clash with those of another file."""
    own = {name for part in ANONYMOUS.findall(text) for name in DEFINED.findall(part)}
    return own | {"".join(found).lower() for found in OF_A_PROGRAM.findall(text)}


def batches(root, given):
    """Lists of sources of one top-level folder that may be compiled together: their arguments fit, and they define no
    name twice. Files of Highway, which include themselves, are each alone."""
    found = []
    for source in given:
        folder, own = source.name.partition("/")[0], Arguments(source.arguments)
        names = names_in((root / source.name).read_text())
        alone = source.name.endswith(("_kernel.cc", "_kernels.cc"))
        for other_folder, common, batch, taken in [] if alone else found:
            if other_folder == folder and len(batch) < MOST_IN_BATCH and common.fits(own) and not names & taken:
                # The build compiles them in ascending order; another order finds more of the missing includes.
                batch.insert(0, source)
                common.add(own)
                taken |= names
                break
        else:
            found.append((None if alone else folder, own, [source], names))
    return [batch for _, _, batch, _ in found]


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
