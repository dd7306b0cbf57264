#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The code that protoc makes of the contract compiles in other languages. That of C++ is compiled by the build, that
of TypeScript by client_sdk/node's tests."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONTRACT = ROOT / "proto"
FILES = sorted((CONTRACT / "carillon/v1").glob("*.proto"))
SERVICES = [file.stem for file in FILES if file.stem.endswith("_service")]
JAVA = pathlib.Path("/usr/share/java")
GO_ROOT = pathlib.Path("/usr/share/gocode")
GO_MODULE = "carillon.audio/go/v1"


def camel(name):
    return "".join(word.capitalize() for word in name.split("_"))


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, **options)
    if done.returncode:
        raise AssertionError(f"{' '.join(map(str, words[:4]))} ... failed:\n{done.stdout}")
    return done.stdout


class LanguagesTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.out = pathlib.Path(scratch.name)

    def generate(self, *options, plugin=None):
        """Runs protoc, with the plugin for services if one is given by its name."""
        path = [f"--plugin=protoc-gen-grpc={shutil.which(plugin)}"] if plugin else []
        run("protoc", "-I", CONTRACT, *path, *options, *FILES)

    def test_python(self):
        self.generate(f"--python_out={self.out}", f"--grpc_out={self.out}", plugin="grpc_python_plugin")
        for service in SERVICES:
            run(sys.executable, "-c", f"from carillon.v1.{service}_pb2_grpc import {camel(service)}Stub", cwd=self.out,
                env=os.environ | {"PYTHONPATH": str(self.out)})

    def test_go(self):
        """The options of the files suffice: no M option is needed."""
        source = self.out / "src"
        source.mkdir()
        self.generate(f"--go_out={source}", f"--go-grpc_out={source}")
        # Debian's libraries of Go are a GOPATH of their own.
        go = os.environ | {"GO111MODULE": "off", "GOPATH": f"{self.out}:{GO_ROOT}", "GOFLAGS": "-mod=mod",
                           "GOCACHE": str(pathlib.Path(os.environ.get("CARILLON_CACHE", self.out)) / "go")}
        run("go", "build", GO_MODULE, env=go, cwd=self.out)
        listed = run("go", "doc", f"{GO_MODULE}.NewContactServiceClient", env=go, cwd=self.out)
        self.assertIn("package carillonv1", listed)

    def test_java(self):
        self.generate(f"--java_out={self.out}", f"--grpc_out={self.out}", plugin="grpc_java_plugin")
        path = ":".join(str(JAVA / f"{name}.jar") for name in (
            "protobuf", "grpc-api", "grpc-stub", "grpc-protobuf", "guava", "geronimo-annotation-1.3-spec"))
        made = self.out / "classes"
        run("javac", "-nowarn", "-proc:none", "-d", made, "-cp", path, *self.out.rglob("*.java"))
        # Each message is a class of its own.
        for name in ("ContactServiceGrpc", "ContactColumns", "ContactProto"):
            self.assertTrue((made / f"audio/carillon/v1/{name}.class").is_file(), name)

    def test_c_sharp(self):
        """Debian has a compiler of C#, but neither the plugin for services nor protobuf's runtime library, so this
        checks the syntax of the messages."""
        self.generate(f"--csharp_out={self.out}")
        made = sorted(self.out.glob("*.cs"))
        self.assertEqual(len(made), len(FILES))
        run("mcs", "--parse", "-langversion:7.2", *made)
        for file in made:
            self.assertIn("namespace Carillon.V1 {", file.read_text())


if __name__ == "__main__":
    unittest.main()
