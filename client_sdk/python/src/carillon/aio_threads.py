# SPDX-License-Identifier: Apache-2.0
"""Calls of the client on threads, for asyncio."""

from __future__ import annotations

import asyncio
import contextvars
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from carillon import client
from carillon.errors import CarillonError, translated

Result = TypeVar("Result")

# The loop's own threads are few, so that calls which wait long would keep the others waiting.
_threads = ThreadPoolExecutor(max_workers=4096, thread_name_prefix="carillon")
# Of a daemon that does not know GetServerInfo.
MOST_RENDERINGS = 4
# The daemon gives the place of a rendering back a little after its end.
PAUSES_S = tuple(0.01 * 2**i for i in range(8))
# For each connection the loop in which it renders, and the renderings that may begin.
_places: WeakKeyDictionary[client.Client, tuple[asyncio.AbstractEventLoop, asyncio.Semaphore]] = WeakKeyDictionary()


async def in_thread(function: Callable[..., Result], *arguments: Any, **named: Any) -> Result:
    """Calls a function of the client on a thread. If the task is cancelled, so are the calls of the function that
    stream, and the others end by themselves."""
    calls: list[Any] = []
    context = contextvars.copy_context()
    context.run(client.running_calls.set, calls)
    work = asyncio.get_running_loop().run_in_executor(_threads, lambda: context.run(function, *arguments, **named))
    try:
        return await asyncio.shield(work)
    except asyncio.CancelledError:
        for call in calls:
            call.cancel()
        await asyncio.wait([work])
        work.exception()
        raise


def cancel_with_task(call: Any) -> None:
    """Has a call cancelled when the task is cancelled that runs this thread's function."""
    calls = client.running_calls.get()
    if calls is not None:
        calls.append(call)


def next_answer(answers: Any, sync: client.Client) -> Any:
    """The next answer of a stream; None at its end. Cancelling the task cancels the stream."""
    cancel_with_task(answers)
    with translated(sync.server):
        return next(answers, None)


def most_renderings(sync: client.Client) -> int:
    """Returns how many renderings the daemon lets one client have at a time."""
    try:
        limits = sync.info().limits
    except CarillonError as error:
        if error.reason != "UNIMPLEMENTED":
            raise
        return MOST_RENDERINGS
    return max(1, int(limits.rendering_count * limits.client_share))


async def render_in_turn(sync: client.Client, function: Callable[..., Result], *arguments: Any, **named: Any) -> Result:
    """Calls a function that renders, as soon as fewer renderings of the connection run than the daemon allows."""
    loop = asyncio.get_running_loop()
    if sync not in _places or _places[sync][0] is not loop:
        count = await in_thread(most_renderings, sync)
        if sync not in _places or _places[sync][0] is not loop:  # another task may have come first
            _places[sync] = loop, asyncio.Semaphore(count)
    async with _places[sync][1]:
        for pause_s in PAUSES_S:
            try:
                return await in_thread(function, *arguments, **named)
            except CarillonError as error:
                if error.reason != "CLIENT_LIMIT_REACHED":
                    raise
            await asyncio.sleep(pause_s)
        return await in_thread(function, *arguments, **named)
