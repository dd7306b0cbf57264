#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the limits of style: 40 lines a function, 400 a file, 5 parameters, 120 columns in text.

C++ is read by its layout, which clang-format fixes: what begins with a line that ends in "{" ends with the first line
of its indent that begins with "}". Its columns are clang-format's. Exceptions are listed in style_exceptions.toml.
"""

import ast
import fnmatch
import re
import tomllib

import project

EXCEPTIONS = "deploy/lint/style_exceptions.toml"
FUNCTION_LINES, FILE_LINES, PARAMETERS, COLUMNS = 40, 400, 5, 120
TEXT = (".md", ".proto", ".py", ".sh", ".cmake")
CODE = (*project.CXX_SUFFIXES, ".proto", ".py", ".sh", ".cmake")
# What opens a block and is no function.
NO_FUNCTION = re.compile(
    r"\b(namespace|class|struct|enum|union|extern|if|else|for|while|switch|do|try|catch|return)\b|=\s*$|\[[^]]*\]\s*$")
SIGNATURE = re.compile(r"([~\w:<>]+|operator\W+)\s*\(")


def lines_of(path):
    return path.read_text(errors="replace").splitlines()


def parameter_count(text, begin):
    """How many parameters the parentheses hold that open at `begin`; 0 where they do not close."""
    depth, count, some = 0, 1, False
    for place in range(begin, len(text)):
        sign = text[place]
        if sign in "(<[{":
            depth += 1
        elif sign in ")>]}" and text[place - 1] != "-":
            depth -= 1
            if depth == 0:
                return count if some else 0
        elif depth == 1 and sign == ",":
            count += 1
        some = some or (depth > 0 and not sign.isspace() and sign != "(")
    return 0


def cxx_heads(lines):
    """(number of the first line, number of the line that ends in "{", text) of all that opens a block."""
    first = None
    for number, line in enumerate(lines):
        code = re.sub(r"//.*", "", line).rstrip()
        stripped = code.strip()
        if not stripped or stripped.startswith(("#", "*")):
            first = None
            continue
        first = number if first is None else first
        if stripped.endswith("{"):
            yield first, number, " ".join(lines[first:number + 1])
        if stripped[-1] in ";{}:" and not stripped.endswith("::"):
            first = None


def cxx_functions(lines):
    """(line, name, lines, parameters) of each function with a body of more than one line."""
    for first, brace, text in cxx_heads(lines):
        found = SIGNATURE.search(text)
        # A call that is given a lambda opens a block within its parentheses.
        if not found or text.count("(") != text.count(")") or text.endswith("= {"):
            continue
        if NO_FUNCTION.search(text[:found.start() + 1]) or NO_FUNCTION.match(found[1]):
            continue
        indent = re.match(r"\s*", lines[first])[0]
        end = next((number for number in range(brace + 1, len(lines)) if lines[number].startswith(indent + "}")), brace)
        yield first + 1, found[1], end - brace + 1, parameter_count(text, found.end() - 1)


def python_functions(lines):
    for node in ast.walk(ast.parse("\n".join(lines))):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            named = [*node.args.posonlyargs, *node.args.args]
            own = named[1:] if named and named[0].arg in ("self", "cls") else named
            yield node.lineno, node.name, node.end_lineno - node.lineno + 1, len(own)


def shell_functions(lines):
    for number, line in enumerate(lines):
        if found := re.match(r"(\w+)\(\) \{$", line):
            end = next((later for later in range(number, len(lines)) if lines[later] == "}"), number)
            yield number + 1, found[1], end - number + 1, 0


def functions_of(path):
    if path.suffix in project.CXX_SUFFIXES:
        return cxx_functions(lines_of(path))
    if project.is_script(path, "python3"):
        return python_functions(lines_of(path))
    return shell_functions(lines_of(path)) if project.is_script(path, "bash") else ()


def findings(path):
    """(rule, line, name of the function or "", text) of each limit that a file exceeds."""
    lines = lines_of(path)
    for line, name, length, parameters in functions_of(path):
        if length > FUNCTION_LINES:
            yield "function_lines", line, name, f"{name} has {length} lines, {FUNCTION_LINES} are the limit"
        if parameters > PARAMETERS:
            yield "parameters", line, name, f"{name} has {parameters} parameters, {PARAMETERS} are the limit"
    if len(lines) > FILE_LINES and (path.suffix in CODE or path.name == "CMakeLists.txt"):
        yield "file_lines", len(lines), "", f"{len(lines)} lines, {FILE_LINES} are the limit"
    if path.suffix in TEXT or path.name == "CMakeLists.txt":
        for number, line in enumerate(lines, start=1):
            # A table's row and an address cannot be broken.
            if len(line) > COLUMNS and not line.startswith("|") and "://" not in line:
                yield "columns", number, "", f"{len(line)} columns, {COLUMNS} are the limit"


def files_of(root):
    yield from (path for path in (*sorted(root.glob("*.md")), root / "CMakeLists.txt") if path.is_file())
    for path in project.own_files(root):
        if path.suffix in (*CODE, ".md") or path.name == "CMakeLists.txt" or project.is_script(path, "bash"):
            yield path


def check(root):
    listed = tomllib.loads((root / EXCEPTIONS).read_text())
    unused = {(rule, pattern) for rule, patterns in listed.items() for pattern in patterns}
    for path in files_of(root):
        file = str(path.relative_to(root))
        for rule, line, name, text in findings(path):
            key = f"{file} {name}".strip()
            matching = [pattern for pattern in listed.get(rule, ()) if fnmatch.fnmatchcase(key, pattern)]
            unused.difference_update((rule, pattern) for pattern in matching)
            if not matching:
                yield f"{file}:{line}: {text}"
    for rule, pattern in sorted(unused):
        print(f"{EXCEPTIONS}: nothing of {pattern} exceeds {rule} any more: its line can go")


if __name__ == "__main__":
    project.run(check)
