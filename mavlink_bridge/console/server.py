"""The server's shell: a socket, a thread with uvicorn's loop, and the link that is printed."""

from __future__ import annotations

import contextlib
import io
import socket
from dataclasses import dataclass
from threading import Thread
from typing import TYPE_CHECKING, Self

import segno
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from mavlink_bridge.errors import LinkError

if TYPE_CHECKING:
    from asyncio import Transport
    from pathlib import Path
    from types import TracebackType

    from starlette.types import ASGIApp

    from mavlink_bridge.console.access import Access

FIRST_PORT, _PORTS = 8080, 20
"""Where nothing is asked for: the first that is free from here on."""

_BACKLOG = 64
_MOST_CONNECTIONS = 256  # at once, pages and strangers; chosen: a small computer holds them
_MOST_OF_ONE = 64
"""Connections of one address: so one stranger on the network cannot take them all, and HOLD with them. Chosen: more than ten browsers have."""

_REQUEST_S = (
    10.0  # for a request's head to be there; chosen: longer than any network that can be driven by takes
)
_LEAVE_S = 2  # for open connections to end; chosen: pages connect again


@dataclass(frozen=True, slots=True)
class Certificate:
    """Files of a certificate and its key, for TLS."""

    certificate: Path
    key: Path


def open_socket(host: str, port: int | None) -> socket.socket:
    """Return a socket that listens; without a port the first free one from 8080 on.

    Raises
    ------
    LinkError
        The address cannot be used.
    """
    ports = range(FIRST_PORT, FIRST_PORT + _PORTS) if port is None else (port,)
    trouble: OSError | None = None
    for one in ports:
        try:
            family, kind, _, _, address = socket.getaddrinfo(host, one, type=socket.SOCK_STREAM)[0]
            found = socket.socket(family, kind)
        except OSError as error:
            raise LinkError(f"--listen {host}: {error.strerror or error}", host=host) from None
        try:
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            found.bind(address)
            found.listen(_BACKLOG)
        except OSError as error:
            found.close()
            trouble = error
            continue
        return found
    assert trouble is not None
    raise LinkError(
        f"--listen {host}:{port or f'{FIRST_PORT} and the next'} cannot be used: {trouble.strerror or trouble}",
        host=host,
        advice="choose another port: --listen HOST:PORT",
    )


def own_names() -> frozenset[str]:
    """Return the names by which browsers on the network may call this computer."""
    name = socket.gethostname().lower()
    return frozenset({name, name.partition(".")[0], f"{name.partition('.')[0]}.local"}) - {""}


def network_address(host: str) -> str:
    """Return an address of this computer that others may reach, for a host that means all of them."""
    if host not in ("0.0.0.0", "::", ""):  # noqa: S104 - compared, not bound
        return host
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # sends nothing: asks which of our addresses would
        return str(probe.getsockname()[0])
    return "127.0.0.1"


def page_link(access: Access) -> str:
    """Return the link to open: beyond loopback with the token in its fragment, which no server and no log gets to see."""
    host = network_address(access.host)
    name = f"[{host}]" if ":" in host else host
    link = f"{access.scheme}://{name}:{access.port}/"
    return f"{link}#token={access.token}" if access.needs_token else link


def qr_code(link: str) -> str:
    """Return a link as a QR code for a terminal."""
    out = io.StringIO()
    segno.make(link, error="l").terminal(out, compact=True)
    return out.getvalue()


class PatientProtocol(H11Protocol):
    """HTTP to those who ask for something: a connection that does not is closed, and one address has only so many."""

    def connection_made(self, transport: Transport) -> None:  # type: ignore[override]
        """Take a connection, or not."""
        super().connection_made(transport)
        own = self.client[0] if self.client else ""
        clients = [getattr(one, "client", None) or ("",) for one in self.connections]
        if sum(client[0] == own for client in clients) > _MOST_OF_ONE:
            transport.abort()
            return
        self.loop.call_later(_REQUEST_S, self._look, None)

    def _look(self, before: object) -> None:
        """Close it where no request has come since the last look, nor is one being answered."""
        if self not in self.connections:  # gone, or a WebSocket by now
            return
        if self.cycle is before and (before is None or self.cycle.response_complete):
            self.transport.close()
            return
        self.loop.call_later(_REQUEST_S, self._look, self.cycle)


class Served:
    """An application that is served in a thread of its own; a context manager.

    Parameters
    ----------
    app : ASGI application
    listening : socket.socket
        Open; closed at the end.
    certificate : Certificate, optional
        Speak TLS with it.
    """

    def __init__(
        self, app: ASGIApp, listening: socket.socket, certificate: Certificate | None = None
    ) -> None:
        self._socket = listening
        config = uvicorn.Config(
            app,
            log_config=None,
            access_log=False,
            server_header=False,
            date_header=False,
            lifespan="on",
            http=PatientProtocol,
            ws="websockets-sansio",
            ws_max_size=64 * 1024,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=_LEAVE_S,
            limit_concurrency=_MOST_CONNECTIONS,
            ssl_certfile=certificate.certificate if certificate else None,
            ssl_keyfile=certificate.key if certificate else None,
        )
        self._server = uvicorn.Server(config)
        self._thread = Thread(target=self._run, name="console", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._server.should_exit = True
        self._thread.join(_LEAVE_S + 3.0)
        self._socket.close()

    @property
    def is_running(self) -> bool:
        """Whether it still serves."""
        return self._thread.is_alive()

    def _run(self) -> None:
        self._server.run(sockets=[self._socket])
