"""Keeps other pages of the same browser from the live page's buttons.

A page of any site may open a WebSocket to 127.0.0.1; browsers leave the refusal to the server, by the header Origin. viser has
no option for that, so what it hands to the websockets library is wrapped while its server starts. Host is looked at too: a
name that a foreign site lets point to 127.0.0.1 would make its page one of the same origin.
"""

import http
import inspect
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import websockets.asyncio.server as server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

NAMES = ("127.0.0.1", "localhost", "::1")  # by which this computer calls itself, also at the end of an ssh tunnel


def refusal(headers: Headers) -> str:
    """Why a request is not answered; empty: it is. Programs, which send no Origin, are no pages."""
    host, origin = headers.get("Host", ""), headers.get("Origin")
    if _name_of(f"//{host}") not in NAMES:
        return f"found Host {host}, expected this computer: 127.0.0.1 or localhost"
    if origin is not None and origin != f"http://{host}":
        return f"found a page of {origin}, expected this one: http://{host}"
    return ""


def _name_of(address: str) -> str | None:
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None


@contextmanager
def same_origin_only() -> Iterator[None]:
    """For the servers that the websockets library starts meanwhile."""
    serve = server.serve

    def guarded(*words: Any, process_request: Any = None, **options: Any) -> Any:
        async def look(connection: server.ServerConnection, request: Request) -> Response | None:
            if reason := refusal(request.headers):
                return connection.respond(http.HTTPStatus.FORBIDDEN, f"hexload: {reason}\n")
            answer = None if process_request is None else process_request(connection, request)
            return await answer if inspect.isawaitable(answer) else answer

        return serve(*words, process_request=look, **options)

    server.serve = guarded
    try:
        yield
    finally:
        server.serve = serve
