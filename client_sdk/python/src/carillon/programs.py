# SPDX-License-Identifier: Apache-2.0
"""The program `carillon`, for what it alone can do."""

from __future__ import annotations

import re
import subprocess
from typing import Any, Optional

from carillon.address import default_server
from carillon.errors import CarillonError


def run(program: str, server: Optional[str], *words: Any) -> subprocess.CompletedProcess[str]:
    """Runs `program` with `words`, for the daemon at `server`. Raises CarillonError for what it refuses, and
    FileNotFoundError where it is not installed."""
    done = subprocess.run([program, "--server", server or default_server(), *map(str, words)], capture_output=True,
                          text=True)
    if done.returncode == 0:
        return done
    refusal = re.search(r"^carillon: ([A-Z_]+): (.*)$", done.stderr, re.MULTILINE)
    raise CarillonError(refusal[1], refusal[2]) if refusal else CarillonError("INTERNAL", done.stderr)
