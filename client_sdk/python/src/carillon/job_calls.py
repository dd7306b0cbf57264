# SPDX-License-Identifier: Apache-2.0
"""The calls about decomposition jobs, on messages of the contract."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncGenerator, Callable, Collection, Iterable
from typing import Any, Optional

from carillon import checks, errors, progress
from carillon.connection import Connection
from carillon.v1 import decomposition_pb2, decomposition_service_pb2


def to_states(states: Iterable[str]) -> list[Any]:
    """The values of the contract for states such as "failed"."""
    listed = [states] if isinstance(states, str) else states
    return [checks.choice(decomposition_pb2.JobState, "JOB_STATE_", "an entry of states", state) for state in listed]


def state_of(job: decomposition_pb2.Job) -> str:
    return decomposition_pb2.JobState.Name(job.state).removeprefix("JOB_STATE_").lower()


def is_transfer(job: decomposition_pb2.Job) -> bool:
    return bool(job.kind == decomposition_pb2.JOB_KIND_TRANSFER)


async def listed(connection: Connection, states: Iterable[str] = (),
                 label_contains: str = "") -> AsyncGenerator[decomposition_pb2.Job, None]:
    """Yields the jobs that match, newest first, a page at a time."""
    request = decomposition_service_pb2.ListJobsRequest(states=to_states(states), label_contains=label_contains)
    while True:
        page = await connection.ask(connection.jobs_stub.ListJobs, request)
        for job in page.jobs:
            yield job
        if not page.next_page_token:
            return
        request.page_token = page.next_page_token


async def warn_of_transfers(connection: Connection, models: Collection[str], meanwhile: str) -> None:
    """Warns if transfers of the models are being computed, and says how the objects sound meanwhile. A caller who may
    not list jobs gets no warning."""
    labels = []
    with contextlib.suppress(errors.CarillonError):
        labels = [job.label or job.name async for job in listed(connection, ["queued", "running"])
                  if is_transfer(job) and job.modal_model in models]
    if labels:
        errors.warn_of_transfers(labels, meanwhile)


async def follow(connection: Connection, job: decomposition_pb2.Job, timeout: Optional[float],
                 note: Callable[[decomposition_pb2.Job], None]) -> decomposition_pb2.Job:
    """Follows a job to its end, gives `note` each of its states, and returns the last. Raises CarillonError if the job
    fails, or if it has not ended after `timeout` seconds (DEADLINE_EXCEEDED)."""
    request = decomposition_service_pb2.WatchJobRequest(name=job.name)
    try:
        async for answer in connection.answers(connection.jobs_stub.WatchJob, request, timeout):
            job = answer.job
            note(job)
    except errors.CarillonError as error:
        if error.reason != "DEADLINE_EXCEEDED":
            raise
        doing = f"{state_of(job)} ({progress.activity(job)})" if state_of(job) == "queued" else state_of(job)
        raise errors.CarillonError(error.reason, f"{job.label or job.name} is {doing} and has not ended after "
                                   f"{timeout:.3g} s; wait longer, or cancel the job") from error
    if job.state == decomposition_pb2.JOB_STATE_CANCELLED:
        raise errors.CarillonError("JOB_CANCELLED", f"{job.name} was cancelled; create the model again")
    if job.state != decomposition_pb2.JOB_STATE_SUCCEEDED:
        raise errors.from_info(job.error)
    return job
