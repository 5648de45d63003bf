"""Gauges whose values are looked up when they are asked for."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final, NamedTuple, TypeAlias

from prometheus_client import Metric
from prometheus_client.registry import Collector

PREFIX: Final = "action_assistant_"
#: A value for each tuple of labels.
Labelled: TypeAlias = Mapping[Any, float]


class Family(NamedTuple):
    """One metric: a value for each set of labels, or a single value without labels."""

    name: str
    documentation: str
    values: Labelled | float
    labels: tuple[str, ...] = ()
    kind: str = "gauge"

    def metric(self) -> Metric:
        """Return the metric in the form of the Prometheus client."""
        metric = Metric(PREFIX + self.name, self.documentation, self.kind)
        suffix = "_total" if self.kind == "counter" else ""
        values = self.values if isinstance(self.values, Mapping) else {(): self.values}
        for of, value in values.items():
            metric.add_sample(
                metric.name + suffix, dict(zip(self.labels, of, strict=True)), float(value)
            )
        return metric


class Looked(Collector):
    """A collector of metrics that calls the function `look` for them each time."""

    def __init__(self, look: Callable[[], Iterable[Family]]) -> None:
        self._look = look

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics that a Prometheus registry asks for."""
        for family in self._look():
            yield family.metric()
