#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the package for Node of this folder: the modules, the contract, and the types of its messages.

Usage: pack.py NODE_MODULES FOLDER

NODE_MODULES has what package-lock.json names; deploy/setup.sh installs it. FOLDER gets the package as a folder named
carillon, and as an archive that "npm install" takes.
"""

import gzip
import json
import pathlib
import shutil
import subprocess
import sys
import tarfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# As lib/contract.js loads the files.
LOADING = ("--keepCase", "--longs=Number", "--enums=String", "--defaults", "--oneofs", "--includeComments")


def make_folder(modules, package):
    """Copies what package.json calls the files of the package, and generates the types."""
    package.mkdir(parents=True)
    shutil.copytree(HERE / "lib", package / "lib")
    for file in (HERE / "package.json", HERE / "README.md", ROOT / "LICENSE"):
        shutil.copy(file, package)
    shutil.copytree(ROOT / "proto/carillon", package / "proto/carillon")
    files = sorted(str(file.relative_to(ROOT / "proto")) for file in (ROOT / "proto/carillon/v1").glob("*.proto"))
    subprocess.run(["node", modules / "@grpc/proto-loader/build/bin/proto-loader-gen-types.js", *LOADING,
                    f"--includeDirs={ROOT / 'proto'}", "--grpcLib=@grpc/grpc-js", f"--outDir={package / 'types'}",
                    *files], check=True, stdout=subprocess.DEVNULL)


def archive(package, path):
    """Writes what "npm pack" would, all files in a folder named package; the same bytes each time."""
    def plain(member):
        member.uid = member.gid = member.mtime = 0
        member.uname = member.gname = ""
        return member

    with gzip.GzipFile(path, "wb", mtime=0) as packed, tarfile.open(fileobj=packed, mode="w") as tar:
        tar.add(package, "package", filter=plain)


def main():
    modules, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    version = json.loads((HERE / "package.json").read_text())["version"]
    make_folder(modules, folder / "carillon")
    archive(folder / "carillon", folder / f"carillon-{version}.tgz")


if __name__ == "__main__":
    main()
