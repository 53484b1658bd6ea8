"""Who may speak to the server: by which name, from which page, with which token. Pure: headers in, a refusal out.

On loopback whoever uses this computer may; beyond it only who has had the printed link. A page of another origin, and a name that somebody
else's name server points here (DNS rebinding), get nothing in either case.
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from mavlink_bridge.console.wire import Problem

if TYPE_CHECKING:
    from collections.abc import Mapping

_LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})
_TOKEN_BYTES = 16  # 128 bits, as secrets of sessions have; chosen
_ALLOWED_SITES = frozenset({"same-origin", "none"})


def is_loopback(host: str) -> bool:
    """Return whether an address to listen on is this computer's own."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True, slots=True)
class Access:
    """Who may speak to the server.

    Parameters
    ----------
    host : str
        Where it listens.
    port : int
    own_names : frozenset of str
        Names of this computer that a browser may call it by, beside addresses.
    is_secure : bool
        Whether it speaks TLS.
    token : str
        What the printed link holds; empty on loopback, where none is needed.
    cookie : str
        What a browser that has shown the token holds.
    """

    host: str
    port: int
    own_names: frozenset[str] = frozenset()
    is_secure: bool = False
    token: str = field(default="", repr=False)
    cookie: str = field(default_factory=lambda: secrets.token_urlsafe(_TOKEN_BYTES), repr=False)

    @classmethod
    def of(
        cls, host: str, port: int, own_names: frozenset[str] = frozenset(), *, is_secure: bool = False
    ) -> Access:
        """Return the access to a server; beyond loopback with a new token."""
        token = "" if is_loopback(host) else secrets.token_urlsafe(_TOKEN_BYTES)
        return cls(host, port, frozenset(name.lower() for name in own_names), is_secure, token)

    @property
    def needs_token(self) -> bool:
        """Whether a token is asked for."""
        return bool(self.token)

    @property
    def scheme(self) -> str:
        """``http`` or ``https``."""
        return "https" if self.is_secure else "http"

    @property
    def cookie_name(self) -> str:
        """The cookie's name: cookies do not tell ports apart."""
        return f"pbpp-{self.port}"

    def set_cookie(self) -> str:
        """Return the header that gives a browser its cookie, for as long as the browser runs."""
        secure = "; Secure" if self.is_secure else ""
        return f"{self.cookie_name}={self.cookie}; Path=/; HttpOnly; SameSite=Strict{secure}"

    def takes_token(self, token: str) -> bool:
        """Return whether a token is the right one."""
        return self.needs_token and hmac.compare_digest(token.encode(), self.token.encode())

    # What is refused

    def stranger(self, headers: Mapping[str, str], *, is_index: bool = False) -> Problem | None:
        """Return why a request is not for us, or not from our page; None where it may be.

        Parameters
        ----------
        headers : mapping of str to str
            By lower-case names.
        is_index : bool
            Whether the page itself is asked for: a link to it may be followed from anywhere, as from a chat.
        """
        authority = headers.get("host", "")
        if not self._is_ours(authority):
            return Problem(
                kind="forbidden",
                message="this server does not have that name",
                advice="open the address that pbpp serve printed",
            )
        origin = headers.get("origin")
        if origin is not None and origin != f"{self.scheme}://{authority}":
            return Problem(kind="forbidden", message="requests of other pages are refused")
        site = headers.get("sec-fetch-site")
        if site is not None and site not in _ALLOWED_SITES and not (is_index and _is_followed(headers)):
            return Problem(kind="forbidden", message="requests of other pages are refused")
        return None

    def unknown(self, headers: Mapping[str, str]) -> Problem | None:
        """Return why a request of a browser that has not shown the token is refused; None where it may be."""
        if not self.needs_token or self._has_cookie(headers.get("cookie", "")):
            return None
        return Problem(
            kind="unauthorized",
            message="this page has no access yet",
            advice="open the link that pbpp serve printed, or scan its QR code",
        )

    def _has_cookie(self, text: str) -> bool:
        cookies: SimpleCookie = SimpleCookie()
        try:
            cookies.load(text)
        except CookieError:
            return False
        held = cookies.get(self.cookie_name)
        return held is not None and hmac.compare_digest(held.value.encode(), self.cookie.encode())

    def _is_ours(self, authority: str) -> bool:
        """Return whether a Host header names this server: an address, or a name of this computer; nobody's name server can do that."""
        try:
            parts = urlsplit(f"//{authority}")
            name, port = parts.hostname, parts.port
        except ValueError:
            return False
        default = 443 if self.is_secure else 80
        if name is None or "@" in authority or (port or default) != self.port:
            return False
        if name in _LOOPBACK_NAMES:
            return True
        if is_loopback(self.host):
            return False
        if name in self.own_names:
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return True


def _is_followed(headers: Mapping[str, str]) -> bool:
    """Return whether a person follows a link, so that the page is opened by itself and not within another one."""
    return headers.get("sec-fetch-mode") == "navigate" and headers.get("sec-fetch-dest") == "document"


def content_policy(authority: str, *, is_secure: bool, tiles: str = "") -> str:
    """Return the Content-Security-Policy of the page: our own files and connections, the tiles' host, and nothing else.

    Parameters
    ----------
    authority : str
        Host and port by which the page was asked for.
    is_secure : bool
        Whether by TLS.
    tiles : str
        The origin of the map's tiles, where they are somewhere else.
    """
    socket = f"{'wss' if is_secure else 'ws'}://{authority}"
    connect = " ".join(filter(None, ("'self'", socket, tiles)))
    return "; ".join(
        (
            "default-src 'none'",
            "script-src 'self'",
            "worker-src 'self'",
            "style-src 'self'",
            f"img-src 'self' data: blob:{' ' + tiles if tiles else ''}",
            "font-src 'self'",
            f"connect-src {connect}",
            "manifest-src 'self'",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        )
    )
