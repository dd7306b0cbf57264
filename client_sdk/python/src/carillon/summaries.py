# SPDX-License-Identifier: Apache-2.0
"""What the messages that describe a model and a rendering tell: short forms, beside str() with all fields, and whether
anything was struck."""

from __future__ import annotations

import contextlib

from carillon.checks import counted
from carillon.errors import CarillonError
from carillon.v1 import audio_service_pb2, modal_model_service_pb2


def _of_model(summary: modal_model_service_pb2.ModalModelSummary) -> str:
    return (f"<ModalModelSummary {summary.label or summary.name}: {counted(summary.header.mode_count, 'mode')}, "
            f"{counted(summary.header.node_count, 'node')}>")


def _of_rendering(summary: audio_service_pb2.RenderSummary) -> str:
    return (f"<RenderSummary: {counted(summary.frame_count, 'frame')}, {counted(summary.accepted_count, 'contact')}, "
            f"peak {summary.peak_pa:.3g} Pa>")


def refuse_without_contacts(summary: audio_service_pb2.RenderSummary) -> None:
    """Raises CarillonError if nothing was struck in a rendering. Sustained forces are not counted, but heard."""
    found = summary.findings
    if not (summary.accepted_count or found.load_count or found.zero_impulse_count or summary.peak):
        raise CarillonError("TRACE_EMPTY", "the trace holds no contact, so there is nothing to hear; record a "
                            "simulation in which something is struck")


def shorten() -> None:
    """Gives the two messages their short forms, where protobuf's runtime lets a class of a message be changed."""
    with contextlib.suppress(AttributeError, TypeError):
        setattr(modal_model_service_pb2.ModalModelSummary, "__repr__", _of_model)
        setattr(audio_service_pb2.RenderSummary, "__repr__", _of_rendering)
