#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Fetches the packages of a package-lock.json from the npm registry, without npm: all but those of other machines.

Usage: fetch.py PACKAGE_LOCK FOLDER

The registry, its certificates and proxies are those of npm's settings: npm_config_* in the environment,
~/.npmrc, /etc/npmrc; and https_proxy.
"""

import base64
import hashlib
import io
import json
import os
import pathlib
import platform
import re
import ssl
import sys
import tarfile
import urllib.request

CPU = {"x86_64": "x64", "aarch64": "arm64"}
NPMRC = (pathlib.Path.home() / ".npmrc", pathlib.Path("/etc/npmrc"))


def settings():
    """npm's settings, those of the environment first."""
    found = {}
    for path in reversed(NPMRC):
        text = path.read_text() if path.is_file() else ""
        found.update(re.findall(r"^\s*([^#;\s=]+)\s*=\s*(.*?)\s*$", text, re.M))
    for name, value in os.environ.items():
        if name.lower().startswith("npm_config_"):
            found[name.lower().removeprefix("npm_config_").replace("_", "-")] = value
    return found


def opener(npm):
    handlers = [urllib.request.HTTPSHandler(context=ssl.create_default_context(cafile=npm.get("cafile")))]
    if proxy := npm.get("https-proxy") or npm.get("proxy"):
        handlers.append(urllib.request.ProxyHandler({"http": proxy, "https": proxy}))
    return urllib.request.build_opener(*handlers)


def request(npm, name, version):
    registry = npm.get("registry", "https://registry.npmjs.org").rstrip("/")
    found = urllib.request.Request(f"{registry}/{name}/-/{name.rpartition('/')[2]}-{version}.tgz")
    if token := npm.get(registry.partition(":")[2] + "/:_authToken"):
        found.add_header("Authorization", f"Bearer {token}")
    return found


def checked(archive, integrity):
    algorithm, _, digest = integrity.partition("-")
    if hashlib.new(algorithm, archive).digest() != base64.b64decode(digest):
        sys.exit("fetch.py: what the registry sent has another digest than package-lock.json says: try again")
    return archive


def unpack(archive, folder):
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        for member in tar.getmembers():
            member.name = member.name.partition("/")[2]  # npm's archives hold one folder
            if member.isfile() and ".." not in member.name.split("/"):
                tar.extract(member, folder)


def main():
    npm = settings()
    packages = json.loads(pathlib.Path(sys.argv[1]).read_text())["packages"]
    for path, package in packages.items():
        ours = (CPU.get(platform.machine()) in package.get("cpu", CPU.values())
                and "linux" in package.get("os", ["linux"]))
        if path and ours:
            asked = request(npm, path.rpartition("node_modules/")[2], package["version"])
            try:
                archive = opener(npm).open(asked, timeout=300).read()
            except OSError as error:
                sys.exit(f"fetch.py: {asked.full_url}: {error}; npm_config_registry names another registry, "
                         "npm_config_cafile its certificates")
            unpack(checked(archive, package["integrity"]), pathlib.Path(sys.argv[2]) / path)


if __name__ == "__main__":
    main()
