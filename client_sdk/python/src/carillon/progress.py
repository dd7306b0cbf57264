# SPDX-License-Identifier: Apache-2.0
"""Shows the progress of a decomposition where somebody watches: by tqdm, or in a line where that is missing."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, Optional, Union

from carillon.checks import counted
from carillon.v1 import decomposition_pb2

OnProgress = Callable[[decomposition_pb2.Job], None]
Progress = Union[None, bool, OnProgress]


def phase_name(job: decomposition_pb2.Job) -> str:
    return decomposition_pb2.Phase.Name(job.progress.phase).removeprefix("PHASE_").lower()


def activity(job: decomposition_pb2.Job) -> str:
    """What a job does, such as "mesh", or why it waits, such as "waiting: 2 jobs are before it"."""
    if job.state == decomposition_pb2.JOB_STATE_SUCCEEDED:
        return "done"
    return wait_text(job.wait) if job.state == decomposition_pb2.JOB_STATE_QUEUED else phase_name(job)


def wait_text(wait: decomposition_pb2.JobWait) -> str:
    """Why a job waits, in the words of the command line."""
    if wait.earlier_job_count:
        return (f"waiting: {counted(wait.earlier_job_count, 'job')} {'is' if wait.earlier_job_count == 1 else 'are'} "
                "before it")
    several = wait.running_job_count != 1
    running = counted(wait.running_job_count, "job") if several else wait.running_job_label or "a job"
    if wait.cause == decomposition_pb2.WAIT_CAUSE_WORKER:
        return f"waiting for {'one of ' if several else ''}{running}"
    if wait.cause == decomposition_pb2.WAIT_CAUSE_MEMORY:
        return f"waiting for the memory of {running}"
    if wait.cause == decomposition_pb2.WAIT_CAUSE_COARSE_MODEL:
        return "waiting for its coarse model"
    return "waiting"


def _is_watched() -> bool:
    return "ipykernel" in sys.modules or sys.stderr.isatty()


class ProgressBar:
    """A bar of tqdm; a line on stderr where tqdm is missing."""

    def __init__(self) -> None:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            self._bar: Optional[Any] = None
        else:
            self._bar = tqdm(total=100, unit="%", bar_format="{desc:<24}{percentage:3.0f}%|{bar}| {elapsed}")

    def __call__(self, job: decomposition_pb2.Job) -> None:
        done = job.state == decomposition_pb2.JOB_STATE_SUCCEEDED
        percent = 100 if done else round(100 * job.progress.fraction)
        text = f"{job.label} {activity(job)}"
        if self._bar is None:
            print(f"\r{text:<70.70} {percent:3} %", end="", file=sys.stderr, flush=True)
            return
        self._bar.n = percent
        self._bar.set_description(text)

    def close(self) -> None:
        if self._bar is None:
            print(file=sys.stderr)
        else:
            self._bar.close()


def observer(progress: Progress, shows: bool) -> tuple[OnProgress, Callable[[], None]]:
    """Returns the function to call for each state of a job, and the one to call at the end. `progress` is such a
    function, True for a bar, False for none, and None for a bar if `shows` and stderr is a terminal or a notebook."""
    if callable(progress):
        return progress, lambda: None
    if progress or (progress is None and shows and _is_watched()):
        bar = ProgressBar()
        return bar, bar.close
    return lambda job: None, lambda: None
