"""The right to move: one client at a time holds it, and loses it if it stops renewing it."""

from __future__ import annotations

import hmac
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from cdpr_rt.errors import ControlError
from cdpr_rt.loop.right import LONGEST_S, PublishedRight

SHORTEST_S: Final = 0.2


class LeaseError(ControlError):
    """This client does not hold the right to move; the message names the holder."""


@dataclass(frozen=True)
class Holder:
    """Holder of the right to move, and the time within which it must renew the right."""

    client: str
    left_s: float
    procedure: str = ""
    """The holder's procedure that moves the robot instead of the holder, "" without one."""


@dataclass(frozen=True)
class LeaseRenewal:
    """Renewal of a lease."""

    number: int
    """Number of the grant; commands with this number are valid under this grant only."""
    ttl_s: float


class Lease:
    """Lease of the right to move, given to one client under a token; any thread may use it.

    The holder may lend the right to its procedure, which then moves the robot instead of the holder
    under a second token. Only the holder renews the right.

    `right` gives the loop the number of the grant and its expiry (CLOCK_MONOTONIC). The loop
    compares the expiry with its own clock, so it notices without a message that the holder, or
    this whole process, has fallen silent.
    """

    def __init__(
        self, right: PublishedRight, clock_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self._right = right
        self._clock_ns = clock_ns
        self._lock = threading.Lock()
        self._client = ""
        self._token = self._lent = self._procedure = ""
        self._ttl_ns = self._until_ns = 0

    def take(self, client: str, ttl_s: float) -> str:
        """Give the right to `client` for `ttl_s` at a time; return the token that renews it.

        Raises LeaseError if another client holds it, even under the same name.
        """
        if not SHORTEST_S <= ttl_s <= LONGEST_S:
            raise LeaseError(f"ttl_s {ttl_s:g}; allowed: {SHORTEST_S:g} to {LONGEST_S:g} s")
        with self._lock:
            left_s = self._left_s()
            if left_s > 0.0:
                raise LeaseError(
                    f"{self._client} holds the right to move for at least {left_s:.1f} s"
                )
            self._client, self._token = client, secrets.token_urlsafe(18)
            self._lent = ""
            self._ttl_ns = round(ttl_s * 1e9)
            self._until_ns = self._clock_ns() + self._ttl_ns
            self._right.begin(self._until_ns)
            return self._token

    def renew(self, token: str | None, *, moves: bool = False) -> LeaseRenewal:
        """Extend the lease by its full duration; return the number of the grant and that duration.

        The token of the holder's procedure extends nothing. Raises LeaseError if `token` is not, or
        is no longer, valid, and for the holder if it `moves` while its procedure does.
        """
        with self._lock:
            if not self._is_lent_to(token):
                self._require(token)
                if moves and self._lent:
                    raise LeaseError(f"the {self._procedure} moves the robot; cancel it first")
                self._until_ns = self._clock_ns() + self._ttl_ns
                self._right.until(self._until_ns)
            return LeaseRenewal(self._right.number, self._ttl_ns * 1e-9)

    def lend(self, token: str | None, procedure: str) -> str:
        """Let `procedure` move instead of the holder, until `end_loan`; return its token.

        Raises like `renew`.
        """
        with self._lock:
            self._require(token)
            self._lent, self._procedure = secrets.token_urlsafe(18), procedure
            return self._lent

    def end_loan(self) -> None:
        """Let the holder move again."""
        with self._lock:
            self._lent = ""

    def release(self, token: str | None) -> None:
        """Release the right; a program that moves under it then holds. Raises like `renew`."""
        with self._lock:
            self._require(token)
            self._token = self._lent = ""
            self._until_ns = 0
            self._right.until(0)

    def holder(self) -> Holder | None:
        """Return the holder, or None."""
        with self._lock:
            left_s = self._left_s()
            procedure = self._procedure if self._lent else ""
            return Holder(self._client, left_s, procedure) if left_s > 0.0 else None

    def is_held_by(self, token: str) -> bool:
        """Return whether `token` is that of the holder, or of its procedure."""
        with self._lock:
            same = self._is_lent_to(token) or hmac.compare_digest(
                token.encode(), self._token.encode()
            )
            return same and self._left_s() > 0.0

    def find(self, digest: bytes, digest_of: Callable[[str], bytes]) -> str | None:
        """Return the holder's token if its `digest_of` equals `digest`, None otherwise.

        This identifies a second connection of the holder, which does not send the token itself.
        """
        with self._lock:
            held = self._left_s() > 0.0
            same = hmac.compare_digest(digest_of(self._token), digest)
            return self._token if held and same else None

    def _is_lent_to(self, token: str | None) -> bool:
        lent = bool(token and self._lent) and self._left_s() > 0.0
        return lent and hmac.compare_digest(str(token).encode(), self._lent.encode())

    def _left_s(self) -> float:
        return (self._until_ns - self._clock_ns()) * 1e-9

    def _require(self, token: str | None) -> None:
        held = self._left_s() > 0.0
        if not token:
            who = f"{self._client} holds it" if held else "nobody holds it"
            raise LeaseError(f"this command needs the right to move; {who}")
        if not hmac.compare_digest(token.encode(), self._token.encode()):
            who = f"{self._client} holds it" if held else "it was released or taken over"
            raise LeaseError(f"the right to move is not this client's; {who}")
        if not held:
            raise LeaseError(
                f"the right to move has expired: {self._client} was silent for too long"
            )
