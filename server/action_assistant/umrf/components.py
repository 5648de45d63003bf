"""Strongly connected components of a directed graph, and the nodes that each node can reach.

Nodes are the numbers from 0, and `ways[n]` are the nodes to which edges lead from node `n`. A child without a
row of its own is an end: edges lead to it and none from it.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

#: A set of nodes: bit `n` stands for node `n`.
Mask: TypeAlias = int


def components(ways: Sequence[Iterable[int]]) -> Iterator[list[int]]:
    """Yield the strongly connected components of a directed graph, each after all others to which
    it leads (Tarjan's algorithm without recursion).

    `ways[n]`: the nodes to which edges lead from node `n`. The nodes of a component come in the
    order in which the search found them. Nodes without a row in `ways` are in no component.
    """
    index = [-1] * len(ways)
    low = [0] * len(ways)
    stack: list[int] = []
    on_stack = [False] * len(ways)
    counter = 0
    for root in range(len(ways)):
        if index[root] >= 0:
            continue
        work = [(root, iter(ways[root]))]
        index[root] = low[root] = counter
        counter += 1
        stack.append(root)
        on_stack[root] = True
        while work:
            node, children = work[-1]
            for child in children:
                if child >= len(ways):
                    continue
                if index[child] < 0:
                    index[child] = low[child] = counter
                    counter += 1
                    stack.append(child)
                    on_stack[child] = True
                    work.append((child, iter(ways[child])))
                    break
                if on_stack[child]:
                    low[node] = min(low[node], index[child])
            else:
                work.pop()
                if work:
                    above = work[-1][0]
                    low[above] = min(low[above], low[node])
                if low[node] == index[node]:
                    yield _popped(stack, node, on_stack)


def _popped(stack: list[int], first: int, on_stack: list[bool]) -> list[int]:
    """Remove the nodes of the component that begins with `first` from the stack, and return them."""
    found = [stack.pop()]
    while found[-1] != first:
        found.append(stack.pop())
    for node in found:
        on_stack[node] = False
    found.reverse()
    return found


def reachable(ways: Sequence[Sequence[int]]) -> list[Mask]:
    """Return for each node, as a bit mask, the nodes that paths from it reach. The mask of a node
    has the node itself only if it lies on a loop.

    `ways[n]`: the nodes to which edges lead from node `n`, including nodes without a row of their
    own.
    """
    found = [0] * len(ways)
    for members in components(ways):
        own = sum(1 << node for node in members)
        mask = own if len(members) > 1 or members[0] in ways[members[0]] else 0
        for node in members:
            for child in ways[node]:
                if not own >> child & 1:
                    mask |= 1 << child | (found[child] if child < len(ways) else 0)
        for node in members:
            found[node] = mask
    return found


def nodes_in(mask: Mask) -> Iterator[int]:
    """Yield the numbers of the nodes in a bit mask, the smallest first."""
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest
