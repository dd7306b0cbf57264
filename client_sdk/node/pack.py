#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the package for Node of this folder: the modules, the adapters of engines, the contract, and the types of its
messages and of contacts.

Usage: pack.py NODE_MODULES FOLDER

NODE_MODULES has what package-lock.json names: "npm ci --prefix client_sdk/node" makes client_sdk/node/node_modules.
FOLDER gets the package as a folder named carillon, and as an archive that "npm install" takes.
"""

import gzip
import json
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
GENERATOR = "@grpc/proto-loader/build/bin/proto-loader-gen-types.js"
COMPILER = "typescript/bin/tsc"
DECLARING = ("--allowJs", "--declaration", "--emitDeclarationOnly", "--skipLibCheck", "--target", "es2022", "--module",
             "node16")
# As lib/contract.js loads the files.
LOADING = ("--longs=Number", "--enums=String", "--defaults", "--oneofs", "--includeComments")


def refuse(text):
    raise SystemExit(f"pack.py: {text}")


def check(modules, package):
    """Ends the program with the reason if the package cannot be made."""
    if not (ROOT / "proto/carillon").is_dir():
        refuse(f"{ROOT} has no proto/carillon; run pack.py in a checkout of the project")
    if not (modules / GENERATOR).exists():
        refuse(f"{modules} does not have what package-lock.json names; run \"npm ci --prefix {HERE}\", and name "
               f"{HERE}/node_modules")
    if not shutil.which("node"):
        refuse("there is no program node; install Node 18 or later")
    if package.exists():
        refuse(f"{package} is there already; remove it, or name another folder")


def make_folder(modules, package):
    """Copies what package.json calls the files of the package, and generates the types."""
    package.mkdir()
    shutil.copytree(HERE / "lib", package / "lib")
    (package / "adapters").mkdir()
    for file in (ROOT / "client_sdk/adapters").glob("*.js"):
        shutil.copy(file, package / "adapters")
    for file in (HERE / "package.json", HERE / "README.md", ROOT / "LICENSE"):
        shutil.copy(file, package)
    shutil.copytree(ROOT / "proto/carillon", package / "proto/carillon")
    files = sorted(str(file.relative_to(ROOT / "proto")) for file in (ROOT / "proto/carillon/v1").glob("*.proto"))
    generate(modules / GENERATOR, *LOADING, f"--includeDirs={ROOT / 'proto'}", "--grpcLib=@grpc/grpc-js",
             f"--outDir={package / 'types'}", *files)
    (package.parent / "node_modules").symlink_to(modules.resolve())  # where the compiler looks for what types need
    # The compiler also writes the types of what contacts.js needs, which are nobody's.
    generate(modules / COMPILER, package / "lib/contacts.js", *DECLARING, "--rootDir", package, "--outDir",
             package / "declared")
    (package / "declared/lib/contacts.d.ts").rename(package / "lib/contacts.d.ts")
    shutil.rmtree(package / "declared")


def generate(*words):
    """Runs a program of node_modules that makes types."""
    done = subprocess.run(["node", *words], check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        refuse(f"{words[0]} could not make the types of the package:\n{done.stdout}")


def archive(package, path):
    """Writes what "npm pack" would, all files in a folder named package; the same bytes each time."""
    def plain(member):
        member.uid = member.gid = member.mtime = 0
        member.uname = member.gname = ""
        return member

    with gzip.GzipFile(path, "wb", mtime=0) as packed, tarfile.open(fileobj=packed, mode="w") as tar:
        tar.add(package, "package", filter=plain)


def main():
    if len(sys.argv) != 3:
        refuse(__doc__[__doc__.index("Usage"):].strip())
    modules, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    check(modules, folder / "carillon")
    version = json.loads((HERE / "package.json").read_text())["version"]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # What fails half-way leaves nothing, so that the command can be given again.
        with tempfile.TemporaryDirectory(prefix=".carillon-", dir=folder) as scratch:
            made = pathlib.Path(scratch)
            make_folder(modules, made / "carillon")
            archive(made / "carillon", made / "archive")
            (made / "archive").rename(folder / f"carillon-{version}.tgz")
            (made / "carillon").rename(folder / "carillon")
    except OSError as error:
        refuse(error)


if __name__ == "__main__":
    main()
