"""What is nobody else's business: folders that only this user may enter, files that only they may read."""

import os


def opener(path: str, flags: int) -> int:
    """For `open(…, opener=opener)`: whatever is made by it, only this user may read and write."""
    return os.open(path, flags, 0o600)
