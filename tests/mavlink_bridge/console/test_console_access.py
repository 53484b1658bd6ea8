"""Who may speak to the server: addresses and own names, our own origin, the token; foreign pages and rebinding names get nothing."""

from __future__ import annotations

import pytest

from mavlink_bridge.console.access import Access, content_policy, is_loopback

LOCAL = Access.of("127.0.0.1", 8080)
OPEN = Access.of("0.0.0.0", 8080, frozenset({"Rover-Pi", "rover-pi.local"}))
SECURE = Access.of("192.168.1.5", 443, is_secure=True)


@pytest.mark.parametrize(
    ("access", "host", "is_ours"),
    [
        (LOCAL, "127.0.0.1:8080", True),
        (LOCAL, "localhost:8080", True),
        (LOCAL, "[::1]:8080", True),
        (LOCAL, "localhost:8081", False),
        (LOCAL, "localhost", False),
        (LOCAL, "evil.example:8080", False),  # a name that its owner lets point here
        (LOCAL, "localhost.evil.example:8080", False),
        (LOCAL, "192.168.1.5:8080", False),
        (LOCAL, "", False),
        (LOCAL, "user@localhost:8080", False),
        (LOCAL, "[::1:8080", False),
        (LOCAL, "localhost:http", False),
        (OPEN, "192.168.1.5:8080", True),
        (OPEN, "rover-pi.local:8080", True),
        (OPEN, "ROVER-PI:8080", True),
        (OPEN, "evil.example:8080", False),
        (SECURE, "192.168.1.5", True),
        (SECURE, "192.168.1.5:80", False),
    ],
)
def test_a_server_answers_by_its_own_names_only(access, host, is_ours):
    assert (access.stranger({"host": host}) is None) == is_ours


@pytest.mark.parametrize(
    ("headers", "is_ours"),
    [
        ({}, True),
        ({"origin": "http://localhost:8080"}, True),
        ({"origin": "http://127.0.0.1:8080"}, False),  # another origin than it was called by
        ({"origin": "https://localhost:8080"}, False),
        ({"origin": "http://evil.example"}, False),
        ({"origin": "null"}, False),
        ({"sec-fetch-site": "same-origin"}, True),
        ({"sec-fetch-site": "none"}, True),
        ({"sec-fetch-site": "cross-site"}, False),
        ({"sec-fetch-site": "same-site"}, False),  # another port of this computer
    ],
)
def test_requests_of_other_pages_are_refused(headers, is_ours):
    assert (LOCAL.stranger({"host": "localhost:8080", **headers}) is None) == is_ours


def test_a_link_to_the_page_may_be_followed_from_anywhere_and_nothing_else():
    followed = {
        "host": "localhost:8080",
        "sec-fetch-site": "cross-site",
        "sec-fetch-mode": "navigate",
        "sec-fetch-dest": "document",
    }
    assert LOCAL.stranger(followed, is_index=True) is None
    assert LOCAL.stranger(followed) is not None
    assert LOCAL.stranger({**followed, "sec-fetch-dest": "iframe"}, is_index=True) is not None
    assert LOCAL.stranger({**followed, "host": "evil.example:8080"}, is_index=True) is not None


def test_beyond_loopback_only_who_has_shown_the_token_is_known():
    assert not LOCAL.needs_token
    assert LOCAL.unknown({}) is None
    assert not LOCAL.takes_token("")
    assert OPEN.needs_token
    assert OPEN.unknown({}).kind == "unauthorized"
    assert not OPEN.takes_token("guess")
    assert OPEN.takes_token(OPEN.token)
    cookie = OPEN.set_cookie()
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert "Secure" not in cookie
    assert "Secure" in SECURE.set_cookie()
    held = cookie.partition(";")[0]
    assert OPEN.unknown({"cookie": f"other=1; {held}"}) is None
    assert OPEN.unknown({"cookie": held[:-1]}).kind == "unauthorized"
    assert (
        OPEN.unknown({"cookie": f"pbpp-8080={OPEN.token}"}).kind == "unauthorized"
    )  # the token is no cookie
    assert OPEN.unknown({"cookie": "\x00=;;=,"}).kind == "unauthorized"
    assert SECURE.unknown({"cookie": held}).kind == "unauthorized"  # another server's
    assert OPEN.token not in repr(OPEN)
    assert OPEN.cookie not in repr(OPEN)


def test_what_is_loopback():
    assert is_loopback("127.0.0.1")
    assert is_loopback("::1")
    assert is_loopback("localhost")
    assert not is_loopback("0.0.0.0")
    assert not is_loopback("rover-pi")


def test_the_policy_names_our_own_and_the_map_and_nothing_inline():
    policy = content_policy("localhost:8080", is_secure=False, tiles="https://tiles.example")
    parts = dict(part.split(" ", 1) for part in policy.split("; "))
    assert parts["default-src"] == "'none'"
    assert parts["script-src"] == "'self'"
    assert parts["connect-src"] == "'self' ws://localhost:8080 https://tiles.example"
    assert "unsafe" not in policy
    assert "*" not in policy
