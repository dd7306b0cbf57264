# SPDX-License-Identifier: Apache-2.0
"""Decomposition jobs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Optional

from carillon import checks, errors, progress
from carillon.materials import Material
from carillon.v1 import decomposition_pb2, decomposition_service_pb2

if TYPE_CHECKING:
    from carillon.client import Client
    from carillon.models import Model

# The contract (Progress.extent_m) says above which extent the unit is likely to be wrong.
LIKELY_EXTENT_M = 20


# The daemon cuts longer labels.
MOST_LABEL_BYTES = 200


def to_states(states: Iterable[str]) -> list[Any]:
    """The values of the contract for states such as "failed"."""
    listed = [states] if isinstance(states, str) else states
    return [checks.choice(decomposition_pb2.JobState, "JOB_STATE_", "an entry of states", state) for state in listed]


class Job:
    """A decomposition that waits, runs or has ended. `message` is its newest known state."""

    def __init__(self, client: Client, message: decomposition_pb2.Job, material: Material | None = None,
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
        return decomposition_pb2.JobState.Name(self.message.state).removeprefix("JOB_STATE_").lower()

    @property
    def _doing(self) -> str:
        """The state and, of a job that waits, the reason."""
        return f"{self.state} ({progress.activity(self.message)})" if self.state == "queued" else self.state

    @property
    def is_transfer(self) -> bool:
        """Whether the job computes how a stored model radiates, and not a model."""
        return bool(self.message.kind == decomposition_pb2.JOB_KIND_TRANSFER)

    def wait(self, progress_bar: progress.Progress = None, timeout: Optional[float] = None) -> Model:
        """Follows the job to its end and returns its model. Raises CarillonError if it fails, or if it has not ended
        after `timeout` seconds (DEADLINE_EXCEEDED)."""
        on_progress, close = progress.observer(progress_bar)
        request = decomposition_service_pb2.WatchJobRequest(name=self.name)
        try:
            with errors.translated(self._client.server):
                watch = self._client.jobs_stub.WatchJob(request, timeout=timeout)
                with self._client.cancellable(watch):
                    for answer in watch:
                        self._note(answer.job)
                        on_progress(answer.job)
        except errors.CarillonError as error:
            if error.reason != "DEADLINE_EXCEEDED":
                raise
            raise errors.CarillonError(error.reason, f"{self.message.label or self.name} is {self._doing} and has not "
                                       f"ended after {timeout:.3g} s; wait longer, or cancel the job") from error
        finally:
            close()
        if self.message.state == decomposition_pb2.JOB_STATE_CANCELLED:
            raise errors.CarillonError("JOB_CANCELLED", f"{self.name} was cancelled; create the model again")
        if self.message.state != decomposition_pb2.JOB_STATE_SUCCEEDED:
            raise errors.from_info(self.message.error)
        model = self._client.model(self.message.modal_model, material=self._material)
        if self._label != model.label and 0 < len(self._label.encode()) <= MOST_LABEL_BYTES:
            errors.warn_of_label(model.label, self._label)
        self._label = ""
        return model

    def _note(self, message: decomposition_pb2.Job) -> None:
        """Takes a newer state, and warns once of a body so large that its unit is likely to be wrong."""
        extent_m = message.progress.extent_m
        if extent_m > LIKELY_EXTENT_M >= self.message.progress.extent_m:
            errors.warn_of_unit(extent_m)
        self.message = message

    def cancel(self) -> None:
        """Cancels the job for this client; it goes on as long as another client wants it that has asked for it, too.
        One that has ended stays as it is."""
        request = decomposition_service_pb2.CancelJobRequest(name=self.name)
        with errors.translated(self._client.server):
            self.message = self._client.jobs_stub.CancelJob(request).job

    def refresh(self) -> Job:
        """Asks the daemon for the newest state."""
        request = decomposition_service_pb2.GetJobRequest(name=self.name)
        with errors.translated(self._client.server):
            self.message = self._client.jobs_stub.GetJob(request).job
        return self

    def __repr__(self) -> str:
        share = f", {self.message.progress.fraction:.0%}" if self.state == "running" else ""
        return f"<Job {self.message.label or self.name}: {self.state}{share}>"
