# SPDX-License-Identifier: Apache-2.0
"""Short forms of the messages that describe a model and a rendering. str() of them has all fields."""

from __future__ import annotations

import contextlib

from carillon.checks import counted
from carillon.v1 import audio_service_pb2, modal_model_service_pb2


def _of_model(summary: modal_model_service_pb2.ModalModelSummary) -> str:
    return (f"<ModalModelSummary {summary.label or summary.name}: {counted(summary.header.mode_count, 'mode')}, "
            f"{counted(summary.header.node_count, 'node')}>")


def _of_rendering(summary: audio_service_pb2.RenderSummary) -> str:
    return (f"<RenderSummary: {counted(summary.frame_count, 'frame')}, {counted(summary.accepted_count, 'contact')}, "
            f"peak {summary.peak_pa:.3g} Pa>")


def shorten() -> None:
    """Gives the two messages their short forms, where protobuf's runtime lets a class of a message be changed."""
    with contextlib.suppress(AttributeError, TypeError):
        setattr(modal_model_service_pb2.ModalModelSummary, "__repr__", _of_model)
        setattr(audio_service_pb2.RenderSummary, "__repr__", _of_rendering)
