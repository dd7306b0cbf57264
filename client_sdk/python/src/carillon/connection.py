# SPDX-License-Identifier: Apache-2.0
"""The connection to a daemon: its channel, the services of the contract, and how they are called."""

from __future__ import annotations

import functools
import os
import pathlib
from collections.abc import AsyncGenerator, Awaitable, Callable
from typing import Any, Optional, TypeVar

import grpc
import grpc.aio

from carillon import checks, errors, forks
from carillon.address import default_server, is_local
from carillon.faces import Block
from carillon.v1 import (
    audio_service_pb2_grpc, contact_service_pb2_grpc, decomposition_service_pb2_grpc,
    material_pb2, modal_model_service_pb2_grpc, scene_service_pb2_grpc, server_service_pb2_grpc)

Result = TypeVar("Result")

CREDENTIALS = ("tls_roots", "token", "tls_certificate", "tls_key")


class _Authorized:
    """A channel whose calls show a token."""

    def __init__(self, channel: Any, token: str):
        self._channel = channel
        self._metadata = (("authorization", f"Bearer {token}"),)

    def __getattr__(self, name: str) -> Any:
        member = getattr(self._channel, name)
        if not name.startswith(("unary_", "stream_")):
            return member
        return lambda *method, **codecs: functools.partial(member(*method, **codecs), metadata=self._metadata)


class Connection(Block):
    """A connection, which opens at its first call. The attributes *_stub are all services of the contract but
    AdminService, for calls that have no method here."""

    is_awaited: bool

    def __init__(self, server: Optional[str] = None, *, tls_roots: str | os.PathLike[str] | None = None,
                 token: Optional[str] = None, tls_certificate: str | os.PathLike[str] | None = None,
                 tls_key: str | os.PathLike[str] | None = None):
        self.server = server or default_server()
        if self.server.startswith("/") or self.server.lower().startswith(("http://", "https://")):
            checks.refuse(self.server, "server", '"unix:PATH" or "HOST:PORT"')
        self._token = token or os.environ.get("CARILLON_TOKEN")
        if self._token and tls_roots is None and not is_local(self.server):
            raise errors.CarillonError("TLS_REQUIRED", f"the token would cross the network to {self.server} in clear; "
                                       "give tls_roots, or the address of a daemon on this machine, or no token")
        self._pem_files = [path and pathlib.Path(path).read_bytes() for path in (tls_roots, tls_key, tls_certificate)]
        self.catalogue: Optional[dict[str, material_pb2.Material]] = None  # of materials, once it was asked for
        self.sounded_models: set[str] = set()  # for which it was asked whether their transfer is being computed
        forks.open_in_children(self)

    @functools.cached_property
    def _channel(self) -> Any:
        # A proxy would reach another machine than this one.
        options = [("grpc.max_receive_message_length", -1), ("grpc.enable_http_proxy", int(not is_local(self.server)))]
        module = grpc.aio if self.is_awaited else grpc
        if self._pem_files[0] is None:
            channel = module.insecure_channel(self.server, options)
        else:
            channel = module.secure_channel(self.server, grpc.ssl_channel_credentials(*self._pem_files), options)
        return _Authorized(channel, self._token) if self._token else channel

    @functools.cached_property
    def models_stub(self) -> Any:
        return modal_model_service_pb2_grpc.ModalModelServiceStub(self._channel)

    @functools.cached_property
    def jobs_stub(self) -> Any:
        return decomposition_service_pb2_grpc.DecompositionServiceStub(self._channel)

    @functools.cached_property
    def scenes_stub(self) -> Any:
        return scene_service_pb2_grpc.SceneServiceStub(self._channel)

    @functools.cached_property
    def contacts_stub(self) -> Any:
        return contact_service_pb2_grpc.ContactServiceStub(self._channel)

    @functools.cached_property
    def audio_stub(self) -> Any:
        return audio_service_pb2_grpc.AudioServiceStub(self._channel)

    @functools.cached_property
    def server_stub(self) -> Any:
        return server_service_pb2_grpc.ServerServiceStub(self._channel)

    def forget(self) -> None:
        """Opens another channel at the next call, as in a process that was forked."""
        for name in [name for name in vars(self) if name == "_channel" or name.endswith("_stub")]:
            del vars(self)[name]

    async def ask(self, method: Any, request: Any) -> Any:
        """Calls a method that answers one message. `request` is a message, or an iterable of them. Raises
        CarillonError, as all calls do."""
        forks.refuse()
        with errors.translated(self.server):
            answer = method(request)
            return await answer if self.is_awaited else answer

    async def answers(self, method: Any, request: Any, timeout: Optional[float] = None) -> AsyncGenerator[Any, None]:
        """Calls a method that answers a stream, and yields its messages."""
        forks.refuse()
        async for message in self.messages(method(request, timeout=timeout)):
            yield message

    async def messages(self, call: Any) -> AsyncGenerator[Any, None]:
        """Yields the messages of a call, which is cancelled where the loop over them is left."""
        with errors.translated(self.server):
            try:
                if self.is_awaited:
                    async for message in call:
                        yield message
                else:
                    for message in call:
                        yield message
            finally:
                call.cancel()

    async def in_turn(self, render: Callable[[], Awaitable[Result]]) -> Result:
        """Awaits a rendering once the daemon takes one more of this connection."""
        return await render()

    async def _close(self) -> None:
        if "_channel" in vars(self):
            closing = self._channel.close()
            if self.is_awaited:
                await closing

    async def _leave(self, kind: Optional[type[BaseException]]) -> None:
        await self._close()
