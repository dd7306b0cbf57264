# SPDX-License-Identifier: Apache-2.0
"""Rendering traces offline."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import numpy

from carillon import checks, errors, job_calls
from carillon.connection import Connection
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import audio_service_pb2

LEAST_FULL_SCALE_PA = 0.00002


async def render(connection: Connection, trace: Trace, settings: dict[str, Any], normalize: bool = False) -> Sound:
    """Renders a trace; see Client.render."""
    sound = await connection.in_turn(lambda: _render(connection, trace, settings))
    if not normalize:
        return sound
    summary = sound.summary
    if (summary and "full_scale_pa" not in settings
            and (0 < summary.peak < 0.01 or summary.limited_frame_count > 0)):
        louder = {**settings, "full_scale_pa": max(1.5 * summary.peak_pa, LEAST_FULL_SCALE_PA)}
        sound = await connection.in_turn(lambda: _render(connection, trace, louder))
    return sound.normalized()


async def _render(connection: Connection, trace: Trace, given: dict[str, Any]) -> Sound:
    request = audio_service_pb2.RenderRequest
    settings = checks.message(audio_service_pb2.RenderSettings, "render", given)

    def requests() -> Iterator[audio_service_pb2.RenderRequest]:
        yield request(settings=settings)
        yield from (request(record=record) for record in trace.records())

    blocks, rate_hz, channels, summary = [], 0, 1, audio_service_pb2.RenderSummary()
    blows: list[audio_service_pb2.Blow] = []
    async for answer in connection.answers(connection.audio_stub.Render, requests()):
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
        await _warn_of_transfers(connection, {item.modal_model for item in trace.objects})
    samples = numpy.frombuffer(b"".join(blocks), "<f4").reshape(-1, channels)
    return Sound(samples, rate_hz, summary=summary, blows=tuple(blows))


async def _warn_of_transfers(connection: Connection, models: set[str]) -> None:
    """Warns if transfers of the models are being computed. A caller who may not list jobs gets no warning."""
    labels = []
    with contextlib.suppress(errors.CarillonError):
        labels = [job.label or job.name async for job in job_calls.listed(connection, ["queued", "running"])
                  if job_calls.is_transfer(job) and job.modal_model in models]
    if labels:
        errors.warn_of_transfers(labels)
