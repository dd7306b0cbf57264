# SPDX-License-Identifier: Apache-2.0
"""Rendering traces offline."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, Optional

import numpy

from carillon import checks, errors, job_calls
from carillon.connection import Connection
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import audio_service_pb2

LEAST_FULL_SCALE_PA = 0.00002


async def render(connection: Connection, trace: Trace, settings: dict[str, Any], normalize: bool = False,
                 timeout: Optional[float] = None) -> Sound:
    """Renders a trace; see Client.render."""
    try:
        return await _rendered(connection, trace, settings, normalize, timeout)
    except errors.CarillonError as error:
        if error.reason != "DEADLINE_EXCEEDED":
            raise
        raise errors.CarillonError(error.reason, f"the rendering has not ended after {timeout:.3g} s; wait longer, or "
                                   "look whether the times of the trace are seconds") from error


async def _rendered(connection: Connection, trace: Trace, settings: dict[str, Any], normalize: bool,
                    timeout: Optional[float]) -> Sound:
    end_s = None if timeout is None else time.monotonic() + timeout
    sound = await connection.in_turn(lambda: _render(connection, trace, settings, end_s))
    if not normalize:
        return sound
    summary = sound.summary
    if (summary and "full_scale_pa" not in settings
            and (0 < summary.peak < 0.01 or summary.limited_frame_count > 0)):
        louder = {**settings, "full_scale_pa": max(1.5 * summary.peak_pa, LEAST_FULL_SCALE_PA)}
        sound = await connection.in_turn(lambda: _render(connection, trace, louder, end_s))
    return sound.normalized()


async def _render(connection: Connection, trace: Trace, given: dict[str, Any], end_s: Optional[float]) -> Sound:
    request = audio_service_pb2.RenderRequest
    settings = checks.message(audio_service_pb2.RenderSettings, "render", given)

    def requests() -> Iterator[audio_service_pb2.RenderRequest]:
        yield request(settings=settings)
        yield from (request(record=record) for record in trace.records())

    blocks, rate_hz, channels, summary = [], 0, 1, audio_service_pb2.RenderSummary()
    blows: list[audio_service_pb2.Blow] = []
    left_s = None if end_s is None else max(0, end_s - time.monotonic())
    async for answer in connection.answers(connection.audio_stub.Render, requests(), left_s):
        kind = answer.WhichOneof("response")
        if kind == "format":
            rate_hz, channels = answer.format.sample_rate_hz, answer.format.channel_count
        elif kind == "block":
            blocks.append(answer.block.samples)
        elif kind == "blows":
            blows.extend(answer.blows.blows)
        else:
            summary = answer.summary
    if summary.rejected_count:
        raise errors.from_info(summary.last_rejection)
    for warning in summary.warnings:
        if warning.id == "TRACE_EMPTY":
            raise errors.CarillonError(warning.id, warning.text)
    errors.warn_of_contacts(summary.warnings)
    if summary.paper_coupling_object_count:
        await job_calls.warn_of_transfers(connection, {item.modal_model for item in trace.objects},
                                          "the sound is by the paper's coupling, and the same rendering will sound "
                                          "different later")
    samples = numpy.frombuffer(b"".join(blocks), "<f4").reshape(-1, channels)
    return Sound(samples, rate_hz, summary=summary, blows=tuple(blows))
