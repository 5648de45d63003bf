"""The token of whoever scrapes: it opens /metrics, and nothing else."""

import hashlib
import hmac
from typing import Final

METRICS: Final = "/metrics"


class ScrapeToken:
    """Compares tokens in constant time. If no token is set, no request is accepted."""

    def __init__(self, token: str | None = None) -> None:
        self._digest = None if token is None else _digest(token)

    def opens(self, method: str, path: str, token: str) -> bool:
        """Return whether the token is right and the request is `GET /metrics`."""
        wanted = self._digest
        is_it = wanted is not None and hmac.compare_digest(_digest(token), wanted)
        return is_it and method == "GET" and path == METRICS


def _digest(token: str) -> bytes:
    """Return a digest of the token, which has the same length for every token."""
    return hashlib.sha256(token.encode(errors="replace")).digest()
