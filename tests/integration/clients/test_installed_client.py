# SPDX-License-Identifier: Apache-2.0
"""The client of C++ as users get it: installed by the commands of CONTRIBUTING.md, found by CMake, pkg-config and the
compiler, and sounding."""

import os
import re
import shlex
import subprocess

import numpy

from daemon import BUILD, ROOT, DaemonTest

EXAMPLE = ROOT / "client_sdk/examples/strike"
# Whatever else a build of the daemon looks for.
NOT_FOR_THE_CLIENT = ("GTest", "benchmark", "CLI11", "nlohmann_json", "spdlog", "tomlplusplus",
                      "SQLite3", "SQLiteCpp", "Eigen3", "CGAL", "embree", "hwy", "assimp", "OpenVDB")


def run(*command, **options):
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True,
                          **options)


def commands(page, heading):
    """The indented blocks of a section of a page, which bash runs."""
    section = re.search(rf"(?ms)^## {heading}$(.*?)^## ", (ROOT / page).read_text())[1]
    return [re.sub("(?m)^    ", "", block) for block in re.findall(r"(?m)(?:^    .*\n)+", section)]


INSTALL, FIND = commands("CONTRIBUTING.md", "Install the clients from a build")


class InstalledClientTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.prefix = cls.folder / "carillon"
        cls.environment = {**os.environ, "HOME": str(cls.folder)}
        # The folder is a checkout with its build, and the home of its user.
        (cls.folder / "build").mkdir()
        (cls.folder / "build/release").symlink_to(BUILD)
        cls.bash(INSTALL)
        cls.daemon.command("example", "bowl", "--out", cls.folder / "bowl.obj")
        cls.model = cls.c.create_model(cls.folder / "bowl.obj", "bell_bronze").name

    @classmethod
    def bash(cls, text, **options):
        return run("bash", "-euc", text, cwd=cls.folder, env=cls.environment, **options)

    def assert_strikes(self, program):
        """Runs `program`, and listens to the daemon meanwhile."""
        strikes = []
        heard = self.client.listen(2.0, on_start=lambda: strikes.append(subprocess.Popen(
            [program, self.model], env={**os.environ, "CARILLON_SERVER": self.daemon.server},
            stdout=subprocess.PIPE, text=True)))
        said, _ = strikes[0].communicate(timeout=60)
        self.assertEqual(strikes[0].returncode, 0)
        self.assertRegex(said, r"\baccepted_count: 1\b")
        self.assertGreater(numpy.abs(numpy.array(heard.samples)).max(), 1e-4)

    def test_a_project_that_finds_the_package_strikes_a_running_daemon(self):
        build = self.folder / "cmake"
        self.bash(f"{FIND}cmake -G Ninja -S {EXAMPLE} -B {build}\ncmake --build {build}")
        self.assert_strikes(build / "strike")

    def test_pkg_config_says_how_to_compile_and_link(self):
        flags = self.bash(f"{FIND}pkg-config --cflags --libs carillon-client")
        program = self.folder / "strike"
        run("c++", "-std=c++20", EXAMPLE / "main.cc", "-o", program, *shlex.split(flags.stdout))
        self.assert_strikes(program)

    def test_the_falling_bar_of_the_page_is_heard_and_comes_to_rest(self):
        page = (ROOT / "docs/ten_minutes_cpp.md").read_text()
        (self.folder / "fall.cc").write_text(re.search(r"(?ms)`fall.cc`:\n\n```cpp\n(.*?)^```$", page)[1])
        compiles, = re.findall(r"(?m)^c\+\+ .*\n", page)
        said = self.bash(f"{FIND}{compiles}CARILLON_SERVER={self.daemon.server} ./fall {self.model}")
        self.assertRegex(said.stdout, r"^blows: [3-9], loads: \d{2,}\n$")
        none = self.bash("CARILLON_SERVER=unix:/nowhere ./fall modalModels/0 2>&1 || true").stdout
        self.assertRegex(none, "^(?!terminate).*/nowhere")

    def test_an_older_minor_version_is_not_taken_for_this_one(self):
        project = self.folder / "older"
        project.mkdir()
        (project / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(older NONE)\n"
            "find_package(carillon 0.0 CONFIG)\nmessage(\"found: ${carillon_FOUND}\")\n")
        said = run("cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}")
        self.assertIn("found: 0", said.stderr)

    def test_installed_headers_know_nothing_of_grpc_and_of_this_tree(self):
        headers = list((self.prefix / "include").rglob("*.h"))
        self.assertIn(self.prefix / "include/carillon/client.h", headers)
        for header in headers:
            for included in re.findall(r'#include ["<]([^">]+)', header.read_text()):
                self.assertFalse(included.startswith(("grpc", "proto/", "client_sdk/")),
                                 f"{header} includes {included}")

    def test_the_client_alone_needs_nothing_but_grpc_protobuf_and_absl(self):
        refused = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{package}=ON" for package in NOT_FOR_THE_CLIENT]
        run("cmake", "--preset", "client", "-B", self.folder / "alone", *refused, cwd=ROOT)
        targets = run("cmake", "--build", self.folder / "alone", "--target", "help").stdout
        self.assertIn("carillon_client:", targets)
        for other in ("carillond:", "carillon-precompute:", "carillon:"):
            self.assertNotIn(f"\n{other}", targets)

    def test_a_project_that_adds_this_one_as_a_folder_gets_the_client_alone(self):
        project = self.folder / "outer"
        project.mkdir()
        (project / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(outer LANGUAGES C CXX)\n"
            f"add_subdirectory({ROOT} carillon)\nadd_executable(strike {EXAMPLE}/main.cc)\n"
            "target_link_libraries(strike PRIVATE carillon::client)\n")
        run("cmake", "-G", "Ninja", "-S", project, "-B", project / "build")
        targets = run("cmake", "--build", project / "build", "--target", "help").stdout
        self.assertIn("\ncarillon_client:", targets)
        self.assertNotIn("\ncarillond:", targets)
