# SPDX-License-Identifier: Apache-2.0
"""The token by which a daemon knows a caller."""

from __future__ import annotations

from typing import Any, NamedTuple, Optional

import grpc


class _Details(NamedTuple):
    """What gRPC knows of a call before it begins."""

    method: str
    timeout: Optional[float]
    metadata: Any
    credentials: Any
    wait_for_ready: Optional[bool]
    compression: Any


class _Bearer(grpc.UnaryUnaryClientInterceptor, grpc.UnaryStreamClientInterceptor, grpc.StreamUnaryClientInterceptor,
              grpc.StreamStreamClientInterceptor):
    """Adds the token to every call."""

    def __init__(self, token: str):
        self._item = ("authorization", f"Bearer {token}")

    def _call(self, proceed: Any, details: Any, request: Any) -> Any:
        metadata = [*(details.metadata or ()), self._item]
        return proceed(_Details(details.method, details.timeout, metadata, details.credentials,
                                details.wait_for_ready, details.compression), request)

    intercept_unary_unary = intercept_unary_stream = intercept_stream_unary = intercept_stream_stream = _call


def authorized(channel: grpc.Channel, token: Optional[str]) -> grpc.Channel:
    """Returns a channel whose calls carry the token, if there is one."""
    return grpc.intercept_channel(channel, _Bearer(token)) if token else channel
