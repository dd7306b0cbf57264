# SPDX-License-Identifier: Apache-2.0
"""Decomposition jobs."""

from __future__ import annotations

from typing import Any, Generic, Optional, TypeVar

from carillon import errors, job_calls, models, progress
from carillon.connection import Connection
from carillon.faces import Awaited, Blocking, call
from carillon.materials import Material
from carillon.models import AnyModel, AsyncModel, Model
from carillon.v1 import decomposition_pb2, decomposition_service_pb2

# The daemon cuts longer labels.
MOST_LABEL_BYTES = 200


class JobCalls(Generic[AnyModel]):
    """A decomposition that waits, runs or has ended. `message` is its newest known state."""

    is_awaited: bool
    _model_kind: type[AnyModel]

    def __init__(self, client: Connection, message: decomposition_pb2.Job, material: Material | None = None,
                 label: str = ""):
        self._client = client
        self._material = material
        self._label = label  # that the caller wanted, if any
        self.message = message

    @property
    def name(self) -> str:
        return self.message.name

    @property
    def state(self) -> str:
        """"queued", "running", "succeeded", "failed" or "cancelled"."""
        return job_calls.state_of(self.message)

    @property
    def is_transfer(self) -> bool:
        """Whether the job computes how a stored model radiates, and not a model."""
        return job_calls.is_transfer(self.message)

    @call
    async def wait(self, progress_bar: progress.Progress = None, timeout: Optional[float] = None) -> AnyModel:
        """Follows the job to its end and returns its model. `progress_bar` is a function, which gets each state of the
        job, True for a bar of tqdm or a line, False for none, and None for a bar where somebody watches, but not in
        asyncio. Raises CarillonError if the job fails, or if it has not ended after `timeout` seconds
        (DEADLINE_EXCEEDED)."""
        on_progress, close = progress.observer(progress_bar, not self.is_awaited)

        def note(message: decomposition_pb2.Job) -> None:
            self.message = message
            on_progress(message)

        try:
            done = await job_calls.follow(self._client, self.message, timeout, note)
        finally:
            close()
        model = self._model_kind(self._client, await models.get(self._client, done.modal_model), self._material)
        if self._label != model.label and 0 < len(self._label.encode()) <= MOST_LABEL_BYTES:
            errors.warn_of_label(model.label, self._label)
        self._label = ""
        return model

    @call
    async def cancel(self) -> None:
        """Cancels the job for this client; it goes on as long as another client wants it that has asked for it, too.
        One that has ended stays as it is."""
        request = decomposition_service_pb2.CancelJobRequest(name=self.name)
        self.message = (await self._client.ask(self._client.jobs_stub.CancelJob, request)).job

    @call
    async def refresh(self) -> Any:
        """Asks the daemon for the newest state. Returns the job."""
        request = decomposition_service_pb2.GetJobRequest(name=self.name)
        self.message = (await self._client.ask(self._client.jobs_stub.GetJob, request)).job
        return self

    def __repr__(self) -> str:
        share = f", {self.message.progress.fraction:.0%}" if self.state == "running" else ""
        return f"<{type(self).__name__} {self.message.label or self.name}: {self.state}{share}>"


class Job(Blocking, JobCalls[Model]):
    """A decomposition that waits, runs or has ended. `message` is its newest known state."""

    _model_kind = Model


class AsyncJob(Awaited, JobCalls[AsyncModel]):
    """A decomposition, whose methods are those of Job, awaited."""

    _model_kind = AsyncModel


AnyJob = TypeVar("AnyJob", bound=JobCalls[Any])
