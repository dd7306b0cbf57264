#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Carillon's decomposition beside the programs that others use, on the same input, in turn.

Each part prints a Markdown table:
  compare   SLEPc on the same matrices: CPU seconds, residuals
  calculix  CalculiX on the same meshes: frequencies
  estimates stated and true errors of every mode of nineteen bodies, with the defaults and for accuracies of 3 % and
            1 %
  bodies    bodies as users have them, with the defaults: verdict, cost, stated errors; with --full meshes of growing
            size, up to a million nodes

CPU seconds are those of one thread for everybody.
"""

import os
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import bench  # noqa: E402
import calculix  # noqa: E402
import compare  # noqa: E402
import estimates  # noqa: E402
import users  # noqa: E402


def fair_environment():
    """One thread, and OpenBLAS' kernels for this processor: Debian's takes its oldest ones on a processor it does
    not know by number. Carillon mends that for itself; here everybody gets the same."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    flags = set(pathlib.Path("/proc/cpuinfo").read_text().partition("flags")[2].partition("\n")[0].split())
    if {"avx512vl", "avx512bw"} <= flags:
        environment.setdefault("OPENBLAS_CORETYPE", "SkylakeX")
    elif {"avx2", "fma"} <= flags:
        environment.setdefault("OPENBLAS_CORETYPE", "Haswell")
    return environment


PARTS = {"compare": compare.compare, "calculix": calculix.compare_frequencies, "estimates": estimates.estimates,
         "bodies": users.users}
HOURS = ("estimates", "bodies")  # take from half an hour to two hours


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--full", action="store_true", help="large bodies, too")
    parser.add_argument("--parts", type=bench.names, default=[part for part in PARTS if part not in HOURS],
                        help=f"some of {','.join(PARTS)}; all but {','.join(HOURS)} unless named")
    parser.add_argument("--only", type=bench.names, default=[], help="bodies, by name")
    options = parser.parse_args()
    for part in options.parts:
        print(f"\n## {part}\n", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            PARTS[part](options, pathlib.Path(folder), fair_environment())
    return 0


if __name__ == "__main__":
    sys.exit(main())
