"""Dependencies: who waits for whom at the start, who waits for himself in the end, and in which order all stop."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence


def cycle(needs: Mapping[str, Collection[str]]) -> list[str]:
    """The names along a circle of those who wait for each other, the first one again at its end; empty without one.

    >>> cycle({"/a": ["/b"], "/b": ["/c"], "/c": ["/b"]})
    ['/b', '/c', '/b']
    >>> cycle({"/a": ["/b", "/c"], "/b": ["/c"], "/c": []})
    []
    """
    done: set[str] = set()
    for name in needs:
        way: list[tuple[str, list[str]]] = [(name, list(needs[name]))]
        while way:
            here, left = way[-1]
            names = [each for each, _ in way]
            following = left.pop(0) if left else None
            if following is None:
                done.add(here)
                way.pop()
            elif following in names:
                return [*names[names.index(following) :], following]
            elif following not in done and following in needs:
                way.append((following, list(needs[following])))
    return []


def stop_order(names: Sequence[str], needs: Mapping[str, Collection[str]]) -> list[str]:
    """The order to stop in: the last one first, but nobody before those who need him.

    >>> stop_order(["/sensors", "/balance", "/motors"], {"/sensors": ["/motors"]})
    ['/balance', '/sensors', '/motors']
    """
    left = list(reversed(names))
    order: list[str] = []
    while left:
        free = next((name for name in left if not any(name in needs.get(other, ()) for other in left)), left[0])
        left.remove(free)
        order.append(free)
    return order
