# SPDX-License-Identifier: Apache-2.0
"""deploy/buf/fetch.py against a registry of its own."""

import base64
import hashlib
import http.server
import io
import json
import os
import platform
import subprocess
import sys
import tarfile
import threading
import unittest

from tree import ROOT, TreeTest

CPU = {"x86_64": "x64", "aarch64": "arm64"}[platform.machine()]


def archive_of(name, text):
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w:gz") as tar:
        member = tarfile.TarInfo(name)
        member.size = len(text)
        tar.addfile(member, io.BytesIO(text))
    return made.getvalue()


class Registry(http.server.BaseHTTPRequestHandler):
    archive = b""

    def do_GET(self):
        known = self.path == "/npm/@maker/tool/-/tool-1.2.3.tgz"
        self.send_response(200 if known and self.headers["Authorization"] == "Bearer secret" else 404)
        self.end_headers()
        self.wfile.write(self.archive)

    def log_message(self, *_):
        pass


class Fetch(TreeTest):
    def setUp(self):
        super().setUp()
        server = http.server.HTTPServer(("127.0.0.1", 0), Registry)
        threading.Thread(target=server.serve_forever).start()
        self.addCleanup(server.server_close)
        self.addCleanup(server.shutdown)
        self.host = f"127.0.0.1:{server.server_port}"
        Registry.archive = archive_of("package/bin/tool", b"works")

    def fetch(self, digest_of):
        integrity = "sha512-" + base64.b64encode(hashlib.sha512(digest_of).digest()).decode()
        self.write("lock.json", json.dumps({"packages": {
            "": {},
            "node_modules/@maker/tool": {"version": "1.2.3", "integrity": integrity, "cpu": [CPU]},
            "node_modules/@maker/other": {"version": "1.2.3", "integrity": integrity, "cpu": ["mips"]},
            "node_modules/a/node_modules/@maker/tool": {"version": "1.2.3", "integrity": integrity}}}))
        self.write(".npmrc", f"registry=http://{self.host}/npm/\n//{self.host}/npm/:_authToken=secret\n")
        environment = {name: value for name, value in os.environ.items()
                       if not name.lower().startswith("npm_config") and "proxy" not in name.lower()}
        return subprocess.run(
            [sys.executable, ROOT / "deploy/buf/fetch.py", self.root / "lock.json", self.root / "got"],
            env=environment | {"HOME": str(self.root)}, capture_output=True, text=True, check=False)

    def test_a_package_comes_from_the_registry_of_npmrc_with_its_token(self):
        done = self.fetch(Registry.archive)
        self.assertEqual(done.returncode, 0, done.stderr)
        files = sorted(path for path in (self.root / "got").rglob("*") if path.is_file())
        self.assertEqual(files, [self.root / "got" / folder / "@maker/tool/bin/tool"
                                 for folder in ("node_modules", "node_modules/a/node_modules")])
        self.assertEqual(files[0].read_text(), "works")

    def test_another_digest_is_refused_and_nothing_is_unpacked(self):
        done = self.fetch(Registry.archive + b"x")
        self.assertIn("another digest", done.stderr)
        self.assertNotEqual(done.returncode, 0)
        self.assertFalse((self.root / "got").exists())


if __name__ == "__main__":
    unittest.main()
