# SPDX-License-Identifier: Apache-2.0
"""The two faces of the package. What asks the daemon is written once, as a coroutine of a class that both faces share.
A class whose calls block (Client, Scene, ...) runs it to its end at once: its connection waits within gRPC, so that the
coroutine never gives way. A class for asyncio (AsyncClient, AsyncScene, ...) returns it, to be awaited."""

from __future__ import annotations

import functools
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Coroutine, Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Optional, TypeVar, overload

if TYPE_CHECKING:
    from typing_extensions import Concatenate, ParamSpec, Self

    P = ParamSpec("P")
else:
    P = TypeVar("P")
Result = TypeVar("Result")


class Blocking:
    """A class whose calls block."""

    is_awaited: ClassVar[bool] = False


class Awaited:
    """A class whose calls are awaited."""

    is_awaited: ClassVar[bool] = True


class Block:
    """What has a beginning and an end, as a context manager of either face."""

    async def _enter(self) -> None:
        """Begins what the block needs."""

    async def _leave(self, kind: Optional[type[BaseException]]) -> None:
        """Ends it; `kind` is that of the exception that leaves the block, if any."""


class BlockingBlock(Block, Blocking):
    def __enter__(self) -> Self:
        finished(self._enter())
        return self

    def __exit__(self, kind: Optional[type[BaseException]], *_: Any) -> None:
        finished(self._leave(kind))


class AwaitedBlock(Block, Awaited):
    async def __aenter__(self) -> Self:
        await self._enter()
        return self

    async def __aexit__(self, kind: Optional[type[BaseException]], *_: Any) -> None:
        await self._leave(kind)


def finished(coroutine: Coroutine[Any, Any, Result]) -> Result:
    """Runs a coroutine of a blocking class to its end, and returns its result."""
    try:
        coroutine.send(None)
    except StopIteration as end:
        return end.value
    coroutine.close()
    raise AssertionError("a coroutine of a blocking class gave way")


def iterated(items: AsyncGenerator[Result, None]) -> Iterator[Result]:
    """The items of an asynchronous generator of a blocking class, which ends when the loop over them is left."""
    try:
        while True:
            try:
                yield finished(items.__anext__())  # type: ignore[arg-type]
            except StopAsyncIteration:
                return
    finally:
        finished(items.aclose())  # type: ignore[arg-type]


class call(Generic[P, Result]):
    """A method that asks the daemon: a coroutine function, which the face of its object runs or returns."""

    def __init__(self, function: Callable[Concatenate[Any, P], Coroutine[Any, Any, Result]]):
        self._function = function
        functools.update_wrapper(self, function)

    @overload
    def __get__(self, item: Blocking, owner: Any = None) -> Callable[P, Result]: ...

    @overload
    def __get__(self, item: Awaited, owner: Any = None) -> Callable[P, Coroutine[Any, Any, Result]]: ...

    @overload
    def __get__(self, item: None, owner: Any = None) -> Callable[..., Any]: ...

    def __get__(self, item: Any, owner: Any = None) -> Any:
        return _bound(self._function, finished, item, owner)


class items(Generic[P, Result]):
    """A method that asks the daemon for one item after the other: an asynchronous generator function."""

    def __init__(self, function: Callable[Concatenate[Any, P], AsyncGenerator[Result, None]]):
        self._function = function
        functools.update_wrapper(self, function)

    @overload
    def __get__(self, item: Blocking, owner: Any = None) -> Callable[P, Iterator[Result]]: ...

    @overload
    def __get__(self, item: Awaited, owner: Any = None) -> Callable[P, AsyncIterator[Result]]: ...

    @overload
    def __get__(self, item: None, owner: Any = None) -> Callable[..., Any]: ...

    def __get__(self, item: Any, owner: Any = None) -> Any:
        return _bound(self._function, iterated, item, owner)


def _bound(function: Callable[..., Any], run: Callable[[Any], Any], item: Any, owner: Any) -> Any:
    """The function as a method of the item, or, without an item, of its class. Of a class that both faces share it is
    the coroutine function itself, by which one call awaits another: await SceneCalls.delete(self)."""
    if not getattr(owner, "is_awaited", True):
        plain = function

        @functools.wraps(plain)
        def blocking(*arguments: Any, **named: Any) -> Any:
            return run(plain(*arguments, **named))

        function = blocking
    return function if item is None else function.__get__(item)
