#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Finds the phrases of words.toml in pages, in comments, and in string literals: errors, help, events of the log.

Code is not read: code blocks, `quoted code`, calls like Code(), and names with an underscore.
"""

import bisect
import fnmatch
import re
import tomllib

import project

LIST = "deploy/lint/words.toml"
COMMENT = re.compile(r"^\s*//+\s?(?!.*SPDX|\s*clang-format|\s*NOLINT)(.*)$")
LITERAL = re.compile(r'"((?:[^"\\]|\\.)*)"')
QUOTED = re.compile(r"`[^`]*`|\b\w+\(\)")
BULLET = re.compile(r"\s*(?:[*+-]|\d+\.|#+)\s")


def page_lines(text):
    """(line number, text) of a Markdown page without its code; None for the end of a paragraph."""
    fenced = False
    blank = True
    for number, line in enumerate(text.splitlines(), start=1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
            yield number, None
        elif fenced or (blank and line.startswith("    ")) or not line.strip():
            blank = True
            yield number, None
        else:
            blank = False
            if BULLET.match(line) or line.startswith("|"):
                yield number, None
            plain = QUOTED.sub("`code`", line.strip())
            yield number, re.sub(r"\]\([^)]*\)", "]", plain).replace("*", "")


def comment_lines(text):
    """(line number, text) of // comments; None where a comment ends."""
    for number, line in enumerate(text.splitlines(), start=1):
        comment = COMMENT.match(line)
        yield number, QUOTED.sub("`code`", comment.group(1).strip()) or None if comment else None


def code_lines(text):
    """comment_lines, and each paragraph of adjacent string literals: errors, help, events of the log."""
    yield from comment_lines(text)
    yield 0, None
    for number, line in enumerate(text.splitlines(), start=1):
        literals = [] if COMMENT.match(line) or line.startswith("#") else LITERAL.findall(line)
        if not literals:
            yield number, None
        for literal in literals:
            yield number, QUOTED.sub("`code`", literal.strip())


READERS = {".md": page_lines, ".h": comment_lines, ".proto": comment_lines, ".cc": code_lines}


def paragraphs(lines):
    """Joins consecutive lines: the text, where in it each line starts, and the lines' numbers."""
    text, starts, numbers = "", [], []
    for number, line in [*lines, (0, None)]:
        if line is not None:
            starts.append(len(text))
            numbers.append(number)
            text += line + " "
        elif text:
            yield text, starts, numbers
            text, starts, numbers = "", [], []


def matches(name, globs):
    return any(fnmatch.fnmatch(name, glob) for glob in globs)


def find(phrases, name, lines):
    for text, starts, numbers in paragraphs(lines):
        for phrase in phrases:
            for match in phrase["pattern"].finditer(text):
                line = numbers[bisect.bisect_right(starts, match.start()) - 1]
                yield f'{name}:{line}: "{match.group(0).strip()}": {phrase["better"]}'


def texts(root):
    yield from sorted(root.glob("*.md"))
    yield from (path for path in project.own_files(root) if path.suffix in READERS)


def check(root):
    words = tomllib.loads((root / LIST).read_text())
    phrases = [{**entry, "pattern": re.compile(entry["phrase"])} for entry in words["phrases"]]
    for path in texts(root):
        name = str(path.relative_to(root))
        if matches(name, words["not_read"]):
            continue
        lines = READERS[path.suffix](path.read_text())
        here = [phrase for phrase in phrases if matches(name, phrase.get("only_in", ["*"]))]
        yield from find(here, name, lines)


if __name__ == "__main__":
    project.run(check)
