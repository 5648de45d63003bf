from typing import Generic, TypeVar

M = TypeVar("M")

class Subscription(Generic[M]):
    @property
    def topic_name(self) -> str: ...
