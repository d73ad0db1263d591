"""Which joint of a character is which joint of a motion's skeleton."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from anim.errors import NotFoundError
from anim.exchange.names import plain
from anim.exchange.roles import roles


@dataclass(frozen=True, slots=True)
class Matching:
    """Pairs of nodes, source → target, in the source's order; source nodes left over; and what persons' joints are.

    source_roles, target_roles: nodes by role ("left_foot"), for alignment; a role is in both or in none.
    """

    pairs: Mapping[int, int]
    unmatched: tuple[int, ...]
    source_roles: Mapping[str, int]
    target_roles: Mapping[str, int]


def match(
    source: Sequence[str],
    target: Sequence[str],
    *,
    aliases: Mapping[str, str],
    of_source: Sequence[int],
    of_target: Sequence[int],
) -> Matching:
    """Return the pairs of nodes whose names mean the same, each node in one pair at most.

    In this order: aliases (source name → target name; "" for none), the same name, the same name without namespace,
    prefix, case, separators and spelling of sides, then the same joint of a person (`roles`).
    of_source, of_target: nodes that take part, the surest first. Raises NotFoundError for an alias of a missing name.
    """
    left = {source[node]: node for node in reversed(of_source)}
    right = {target[node]: node for node in reversed(of_target)}
    everywhere = {name: node for node, name in reversed([*enumerate(target)])} | right
    pairs, excluded = _named(aliases, left, everywhere)
    plain_source, plain_target = plain(source), plain(target)
    by_plain = {plain_target[node]: node for node in reversed(of_target)}
    source_roles, target_roles = roles(plain_source, of_source), roles(plain_target, of_target)
    by_role = {node: role for role, node in source_roles.items()}
    ways: tuple[Callable[[int], int | None], ...] = (
        lambda node: right.get(source[node]),
        lambda node: by_plain.get(plain_source[node]),
        lambda node: target_roles.get(by_role.get(node, "")),
    )
    for way in ways:
        taken = set(pairs.values())
        for node in of_source:
            found = way(node)
            if node not in pairs and node not in excluded and found is not None and found not in taken:
                pairs[node] = found
                taken.add(found)
    ordered = {node: pairs[node] for node in sorted(pairs)}
    shared = {role: node for role, node in source_roles.items() if node in ordered}
    return Matching(
        ordered,
        tuple(node for node in sorted(of_source) if node not in ordered),
        shared,
        {role: ordered[node] for role, node in shared.items()},
    )


def _named(
    aliases: Mapping[str, str], left: Mapping[str, int], right: Mapping[str, int]
) -> tuple[dict[int, int], set[int]]:
    """The pairs that aliases name, and the source nodes that they leave out."""
    pairs: dict[int, int] = {}
    excluded: set[int] = set()
    for name, other in aliases.items():
        if name not in left:
            raise NotFoundError(f"alias for '{name}', which the motion does not have", help=_near(name, left))
        if not other:
            excluded.add(left[name])
        elif other not in right:
            raise NotFoundError(f"alias '{name}' → '{other}', which is not there", help=_near(other, right))
        else:
            pairs[left[name]] = right[other]
    return pairs, excluded


def _near(name: str, names: Mapping[str, int]) -> str:
    found = difflib.get_close_matches(name, names, n=1)
    return f"did you mean '{found[0]}'?" if found else ""
