# SPDX-License-Identifier: Apache-2.0
"""The settings of a decomposition that callers give most, without the messages around them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Optional, Union

from carillon import checks
from carillon.v1 import modal_model_pb2

Settings = Union[None, modal_model_pb2.DecompositionSettings, Mapping[str, Any]]
Unit = Union[str, float]

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}


def to_settings(given: Settings, unit: Optional[Unit], accuracy: Optional[float]) -> Settings:
    """Returns the settings with a unit and an accuracy. Raises TypeError if the settings have them, too."""
    if unit is None and accuracy is None:
        return given
    made = modal_model_pb2.DecompositionSettings()
    if given is not None:
        made.CopyFrom(checks.message(type(made), "settings", given) if isinstance(given, Mapping) else given)
    if unit is not None:
        _refuse_twice("unit", "metres_per_unit", made.metres_per_unit)
        made.metres_per_unit = _metres(unit)
    if accuracy is not None:
        _refuse_twice("accuracy", "mesh.accuracy", made.mesh.accuracy)
        if not (isinstance(accuracy, (int, float)) and 0 < accuracy < 1):
            checks.refuse(accuracy, "accuracy", "a number above 0 and below 1, such as 0.01 for 1 %")
        made.mesh.accuracy = accuracy
    return made


def _metres(unit: Unit) -> float:
    metres = METRES.get(unit) if isinstance(unit, str) else unit
    if not (isinstance(metres, (int, float)) and 0 < metres < math.inf):
        checks.refuse(unit, "unit", "\"m\", \"cm\", \"mm\", \"in\", or a number of metres above zero")
    return metres


def _refuse_twice(name: str, field: str, value: float) -> None:
    if value:
        raise TypeError(f"{name} and settings.{field} are both given; leave one of them out")
