#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Carillon's decomposition beside the programs that others use, on the same input, in turn.

Each part prints a Markdown table:
  compare   SLEPc and Spectra on the same matrices: CPU seconds, residuals
  calculix  CalculiX on the same meshes: frequencies
  growth    time and memory over the number of nodes, up to a million with --full
  estimates stated and true errors of every mode of twelve bodies, six of them with re-entrant corners, with the
            defaults and for accuracies of 3 % and 1 %
  bodies    thirty bodies as users have them, with the defaults: verdict, cost, stated and true errors
  packages  the closed surfaces of some Debian packages, with --repair: the share that ends in a model

Nothing is kept from one run to the next, but for what `packages` adds to the file of --results. Slow programs on
large bodies run with --full only, or where --peers names them. CPU seconds are those of one thread for everybody.
"""

import argparse
import os
import pathlib
import sys
import tempfile

import calculix
import compare
import estimates
import growth
import packages
import users


def processor_flags():
    with open("/proc/cpuinfo", encoding="ascii") as file:
        for line in file:
            if line.startswith("flags"):
                return set(line.split())
    return set()


def fair_environment():
    """One thread, and OpenBLAS' kernels for this processor: Debian's takes its oldest ones on a processor it does
    not know by number. Carillon mends that for itself; here everybody gets the same."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    flags = processor_flags()
    if "OPENBLAS_CORETYPE" not in environment:
        if {"avx512vl", "avx512bw"} <= flags:
            environment["OPENBLAS_CORETYPE"] = "SkylakeX"
        elif {"avx2", "fma"} <= flags:
            environment["OPENBLAS_CORETYPE"] = "Haswell"
    return environment


PARTS = {"compare": compare.compare, "calculix": calculix.compare_frequencies,
         "growth": growth.growth,
         "estimates": estimates.estimates, "bodies": users.users, "packages": packages.packages}


HOURS = ("estimates", "bodies", "packages")  # take from half an hour to two hours


def names(text):
    return text.split(",")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True, help="the release build's folder")
    parser.add_argument("--full", action="store_true", help="slow programs and large bodies, too")
    parser.add_argument("--parts", type=names, default=[part for part in PARTS if part not in HOURS],
                        help=f"some of {','.join(PARTS)}; all but {','.join(HOURS)} unless named")
    parser.add_argument("--only", type=names, default=[], help="bodies, by name")
    parser.add_argument("--peers", type=names, default=[], help="other programs, by name")
    parser.add_argument("--results", type=pathlib.Path,
                        help="where `packages` keeps each outcome, to go on from there (one JSON object a line)")
    options = parser.parse_args()
    for part in options.parts:
        print(f"\n## {part}\n", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            PARTS[part](options, pathlib.Path(folder), fair_environment())
    return 0


if __name__ == "__main__":
    sys.exit(main())
