# SPDX-License-Identifier: Apache-2.0
"""Each checker of deploy/lint passes a right tree, and finds a planted mistake with its file and line."""

import contextlib
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

from tree import ROOT, TreeTest
import check_classes
import check_contract
import check_format
import check_includes
import check_locks
import check_reasons
import check_scripts
import check_text
import check_tidy

BUILD = pathlib.Path(os.environ.get("CARILLON_BUILD", ROOT / "build/release"))
APACHE = "// SPDX-License-Identifier: Apache-2.0\n"
CONTRACT = ('syntax = "proto3";\n\npackage carillon.v1;\n\n// A message.\nmessage Block {\n  // A field.\n'
            "  uint64 first_frame = 1;\n}\n")
BAD_NAME = "int twiceAsMuch(int x) { return 2 * x; }\ninline int Twice(int x) { return twiceAsMuch(x); }"
ROOMS = """system_headers = []
[holds]
"server/base" = "clocks"
[rooms]
"server/base" = ["proto/*"]
[targets]
[libraries]
"""
CLEAN_RENDERER = """#include <cmath>
namespace carillon {
__attribute__((noinline)) static float Square(float x) { return std::sqrt(x * x + 1); }
struct Mixer { float Render(float x); };
float Mixer::Render(float x) { return Square(x); }
}
"""


class Lint(TreeTest):
    def found(self, check, *expected, **files):
        """Writes the files, whose names have __ for / and _dot_ for a point, and asserts what the checker finds."""
        for name, text in files.items():
            self.write(name.replace("__", "/").replace("_dot_", "."), text)
        self.assert_found(check(self.root), *expected)

    def test_a_member_in_a_second_file_is_found(self):
        self.found(check_classes.check, server__mixer_dot_h="class Mixer {\n  Bus& bus();\n  ~Mixer();\n};\n",
                   server__mixer_dot_cc="Mixer::~Mixer() {}\n")
        self.found(check_classes.check, "server/mixer_buses.cc:2: defines a member of Mixer, which mixer.h declares",
                   server__mixer_buses_dot_cc="int x;\nBus& Mixer::bus() {\n}\n")

    def test_a_raw_lock_is_found(self):
        self.found(check_locks.check, server__base__mutex_dot_h="std::mutex mutex_;\n",
                   client_sdk__cpp__a_dot_cc="absl::Mutex a;\n", server__a_dot_cc="Mutex a;  // not std::mutex\n")
        self.found(check_locks.check, "server/b.cc:1", "server/b.cc:2",
                   server__b_dot_cc="std::shared_mutex a;\npthread_mutex_lock(&a);\n")

    def test_an_include_and_a_dependency_that_the_table_does_not_allow_are_found(self):
        self.copy("deploy/lint/rooms.toml")
        self.found(check_includes.check, server__synthesis__a_dot_cc='#include "server/base/clock.h"\n')
        self.write("server/api/CMakeLists.txt", "carillon_room(server_api SOURCES a.cc)\n")
        self.write("server/base/CMakeLists.txt", "carillon_room(server_base SOURCES b.cc DEPENDS server_api)\n")
        self.write("precompute/mesh/a.cc", '#include "server/base/clock.h"\n#include <grpcpp/grpcpp.h>\n')
        self.assert_found(check_includes.check(self.root), "precompute/mesh/a.cc:1", "grpc (grpcpp/grpcpp.h)",
                          "server_base (server/base) may not depend on server_api")

    def test_a_reason_without_a_row_and_a_row_without_a_reason_are_found(self):
        table = "## Files\n| reason | gRPC code | meaning | repair |\n| --- |\n| NO_FILE | NOT_FOUND | m | r |\n"
        self.found(check_reasons.check, server__a_dot_cc='Refusal(code, "NO_FILE", "x");\n',
                   proto__errors_dot_md=table)
        self.found(check_reasons.check, "a name has two rows",
                   proto__errors_dot_md=table + "## Bodies\n| NO_FILE | NOT_FOUND | m | r |\n")
        self.found(check_reasons.check, "troubleshoot.md:2: carillon doctor has no finding IS_LOUD",
                   proto__errors_dot_md=table, client_sdk__a_dot_cc='note("IS_MUTED", "x");',
                   docs__troubleshoot_dot_md="| IS_MUTED | it is | do |\n| IS_LOUD | it is | do |\n")
        self.write("docs/troubleshoot.md", "")
        self.found(check_reasons.check, "a.cc:2: NO_NAME is not", "no code gives NO_FILE",
                   server__a_dot_cc='Refusal(code,\n  "NO_NAME", "x");\n')

    def test_unformatted_code_and_an_unquoted_variable_are_found(self):
        self.copy(".clang-format")
        self.found(check_format.check, server__a_dot_cc="int Twice(int x) { return 2 * x; }\n")
        self.write("server/a.cc", "int Twice( int x ) { return 2*x; }\n")
        self.assertIn("server/a.cc:1", next(iter(check_format.check(self.root))))
        self.found(check_scripts.check, "SC2086", _dot_ci__run="#!/usr/bin/env bash\ntouch $1\n")

    def test_a_wrong_licence_a_long_line_and_a_misspelt_word_are_found(self):
        self.found(check_text.check_lines, server__a_dot_cc=APACHE)
        self.found(check_text.check_lines, "README.md:1: 121 columns", "precompute/a.cc:1",
                   precompute__a_dot_cc=APACHE, README_dot_md="a" * 121 + "\n")
        self.found(check_text.check_spelling, "received", README_dot_md="It is " + "rec" + "ieved.\n")

    def test_a_link_to_no_file_or_heading_is_found_and_code_is_not_read(self):
        page = "# A `b`, c\n[x](b.md#d-e) [y](#a-b-c) [web](https://a.org/b)\n```\n[z](none)\n```\n"
        self.found(check_text.check_links, docs__a_dot_md=page, docs__b_dot_md="## D e\n[y](a.md)\n")
        self.found(check_text.check_links, "docs/b.md:2: the link a.md#d-e", "docs/b.md:3: the link ../b.flac",
                   docs__b_dot_md="# D e\n[x](a.md#d-e)\n![y](../b.flac)\n")

    def test_a_table_of_rooms_that_differs_is_found_and_written(self):
        self.write("deploy/lint/rooms.toml", ROOMS)
        self.write("server/base/clock.cc", "")
        self.write("ARCHITECTURE.md", f"# Page\n{check_text.BEGIN}\n{check_text.END}\nafter\n")
        self.assert_found(check_text.check_room_table(self.root, False), "ARCHITECTURE.md:2: the table of rooms")
        list(check_text.check_room_table(self.root, True))
        self.assert_found(check_text.check_room_table(self.root, False))

    def test_a_contract_that_breaks_the_last_release_is_found(self):
        def git(*arguments):
            words = ["git", "-C", self.root, "-c", "user.name=a", "-c", "user.email=a@b.c", *arguments]
            subprocess.run(words, check=True)
        self.copy("proto/buf.yaml")
        for command in (["init", "-q"], ["commit", "-q", "--allow-empty", "-m", "x"]):
            git(*command)
        self.found(check_contract.check, proto__carillon__v1__block_dot_proto=CONTRACT)
        for command in (["add", "-A"], ["commit", "-qm", "x"], ["tag", "v1"]):
            git(*command)
        self.found(check_contract.check, "deleted", proto__carillon__v1__block_dot_proto=CONTRACT.replace("= 1", "= 2"))

    def test_what_clang_tidy_finds_is_told_until_it_is_mended_and_what_passed_is_not_read_again(self):
        self.root = self.root.resolve()
        self.copy(".clang-tidy")
        os.environ["CARILLON_CACHE"] = str(self.root / "cache")
        self.write("build/compile_commands.json", json.dumps([{
            "directory": str(self.root / "build"), "file": str(self.root / "server/a.cc"),
            "command": f"c++ -std=c++20 -I{self.root} -c {self.root}/server/a.cc"}]))
        self.write("server/a.cc", '#include "server/a.h"\nint Four() { return Twice(2); }\n')
        for text, expected, count in (("int Twice(int x) { return 2 * x; }", [], 1), (None, [], 0),
                                      (BAD_NAME, ["case style"], 1),
                                      (None, ["case style"], 1)):
            if text:
                self.write("server/a.h", f"#pragma once\ninline {text}\n")
            with contextlib.redirect_stdout(io.StringIO()) as said:
                self.assert_found(check_tidy.check(self.root, self.root / "build"), *expected)
            self.assertEqual(int(said.getvalue().split()[0]), count)


class Compiled(unittest.TestCase):
    """The checkers that read what a compiler makes of a file."""

    def run_checker(self, name, *arguments):
        run = subprocess.run([sys.executable, "-B", ROOT / f"deploy/lint/check_{name}.py", *arguments],
                             capture_output=True, text=True, check=False)
        return run.stdout if run.returncode else ""

    def test_what_may_not_be_called_while_rendering_is_found_in_the_archive(self):
        def problems_in(text):
            with tempfile.TemporaryDirectory() as folder:
                pathlib.Path(folder, "mixer.cc").write_text(text, encoding="ascii")
                for command in (["g++", "-std=c++20", "-O1", "-fno-inline", "-c", "mixer.cc"],
                                ["ar", "rcs", "room.a", "mixer.o"]):
                    subprocess.run(command, cwd=folder, check=True)
                return self.run_checker("render_symbols", f"{folder}/room.a")
        self.assertEqual(problems_in(CLEAN_RENDERER + "float* Make() { return new float(1); }\n"), "")
        found = problems_in(CLEAN_RENDERER.replace(
            "return std::sqrt(x * x + 1);", "static float* volatile kept; kept = new float(x); return *kept;"))
        self.assertIn("operator new", found)
        self.assertIn("<- carillon::Mixer::Render", found)
        self.assertIn("getppid", problems_in("#include <unistd.h>\n" + CLEAN_RENDERER.replace(
            "return Square(x);", "return x + getppid();")))

    def test_a_function_called_by_a_thread_of_the_wrong_role_is_found(self):
        def problems_in(body):
            with tempfile.TemporaryDirectory() as folder:
                path = pathlib.Path(folder, "planted.cc")
                path.write_text('#include "server/synthesis/mixer.h"\nnamespace carillon {\nstruct Planted {\n'
                                "  Mutex mutex;\n  int guarded ABSL_GUARDED_BY(mutex) = 0;\n  OscillatorBank& bank;\n"
                                f"  BlockMix& mix;\n  void Run() {{ {body} }}\n}};\n}}\n", encoding="ascii")
                return self.run_checker("thread_roles", BUILD, path)
        self.assertEqual(problems_in("const InRole role(kRenderRole); bank.RenderAdd(mix);"), "")
        self.assertIn("kRenderRole", problems_in("bank.RenderAdd(mix);"))
        self.assertIn("guarded", problems_in("guarded = 1;"))


if __name__ == "__main__":
    unittest.main()
