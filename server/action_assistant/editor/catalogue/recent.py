"""The values that were asked for last."""

from collections import OrderedDict
from typing import Generic, TypeVar

K = TypeVar("K")
V = TypeVar("V")


class Recent(Generic[K, V]):
    """At most `size` of them, which together weigh at most `weight`."""

    def __init__(self, size: int, weight: int | None = None) -> None:
        self._size = size
        self._most = weight
        self._weight = 0
        self._values: OrderedDict[K, tuple[V, int]] = OrderedDict()

    def get(self, key: K) -> V | None:
        """The value, if it is still there."""
        found = self._values.get(key)
        if found is None:
            return None
        self._values.move_to_end(key)
        return found[0]

    def put(self, key: K, value: V, weight: int = 0) -> V:
        """Remember a value, and forget others."""
        self._weight += weight - self._values.pop(key, (None, 0))[1]
        self._values[key] = value, weight
        while len(self._values) > 1 and self._is_too_much():
            _, (_, gone) = self._values.popitem(last=False)
            self._weight -= gone
        return value

    def _is_too_much(self) -> bool:
        return len(self._values) > self._size or (
            self._most is not None and self._weight > self._most
        )
