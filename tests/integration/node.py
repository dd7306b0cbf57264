# SPDX-License-Identifier: Apache-2.0
"""The package for Node, put where programs in JavaScript find it."""

import os
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["CARILLON_BUILD_DIR"])


def node_environment(folder):
    """The environment in which require('carillon') takes the checkout, and what it needs from the npm registry."""
    modules = folder / "node_modules"
    if not modules.exists():
        modules.mkdir()
        (modules / "carillon").symlink_to(ROOT / "client_sdk/node")
    return {**os.environ, "NODE_PATH": f"{modules}:{os.environ['CARILLON_NODE_MODULES']}"}
