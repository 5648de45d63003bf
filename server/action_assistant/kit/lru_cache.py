"""A cache that drops the least recently used values."""

from collections import OrderedDict
from typing import Generic, TypeVar

K = TypeVar("K")
V = TypeVar("V")


class LruCache(Generic[K, V]):
    """Holds up to `size` values whose weights add up to at most `weight`; the newest value always
    stays."""

    def __init__(self, size: int, weight: int | None = None) -> None:
        self._size = size
        self._most = weight
        self._weight = 0
        self._values: OrderedDict[K, tuple[V, int]] = OrderedDict()

    def get(self, key: K) -> V | None:
        """Return the value of a key; None if it has none."""
        found = self._values.get(key)
        if found is None:
            return None
        self._values.move_to_end(key)
        return found[0]

    def put(self, key: K, value: V, weight: int = 0) -> V:
        """Store a value of the given weight under a key, and return the value. The least recently
        used values beyond the limits are dropped."""
        self._weight += weight - self._values.pop(key, (None, 0))[1]
        self._values[key] = value, weight
        while len(self._values) > 1 and self._is_too_much():
            _, (_, dropped) = self._values.popitem(last=False)
            self._weight -= dropped
        return value

    def _is_too_much(self) -> bool:
        return len(self._values) > self._size or (
            self._most is not None and self._weight > self._most
        )
