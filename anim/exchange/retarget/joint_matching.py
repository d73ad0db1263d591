"""Match the joints of a character with those of a motion's skeleton, by name, role or alias file."""

from __future__ import annotations

import csv
import difflib
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

from anim.errors import FormatError, NotFoundError
from anim.exchange.formats.labels import labels
from anim.exchange.formats.text import decode_text, error_at
from anim.exchange.retarget.joint_names import normalize_names
from anim.exchange.retarget.joint_roles import joint_roles
from anim.gltf.io import json_text
from anim.model import Skeleton

MatchReason: TypeAlias = Callable[[int], int | None]  # from a source node to its target node, None without one


@dataclass(frozen=True, slots=True)
class JointMatch:
    """Pairs of nodes, source → target, in the source's order; unmatched source nodes; and body roles.

    source_roles, target_roles: nodes by role ("left_foot"), for alignment; a role is in both or in none.
    """

    pairs: Mapping[int, int]
    unmatched: tuple[int, ...]
    source_roles: Mapping[str, int]
    target_roles: Mapping[str, int]


def match_joints(
    source: Sequence[str],
    target: Sequence[str],
    *,
    aliases: Mapping[str, str],
    of_source: Sequence[int],
    of_target: Sequence[int],
    others: Sequence[int] = (),
    same: Mapping[int, int] = MappingProxyType({}),
    stated: Mapping[str, int] = MappingProxyType({}),
) -> JointMatch:
    """Return pairs of nodes with equivalent names, each node in one pair at most.

    In this order: aliases (source name → target name; "" for none), `same` (source → target node, see
    `match_same_hierarchy`), the joint that the target's file states (`stated`, target node by role), the same name, the
    same name without namespace, prefix, suffix, case, separators and spelling of sides, then the same body role
    (`joint_roles`).
    of_source, of_target: candidate nodes, the most certain first. others: nodes of the target for source nodes without
    a partner among those. Raises NotFoundError for an alias of a missing name.
    """
    left = {source[node]: node for node in reversed(of_source)}
    everywhere = {target[node]: node for node in (*range(len(target))[::-1], *reversed(of_target))}
    pairs, excluded = _match_by_name(aliases, left, everywhere)
    plain_source, plain_target = normalize_names(source), normalize_names(target)
    source_roles = joint_roles(plain_source, of_source)
    by_role = {node: role for role, node in source_roles.items()}

    def by_names(nodes: Sequence[int]) -> tuple[MatchReason, ...]:
        """Partners among these nodes: by equal name, by normalized name, by role.

        Numbers differ in meaning between skeletons ("spine1"): roles precede normalized names.
        """
        right = {target[node]: node for node in reversed(nodes)}
        by_own_role = joint_roles(plain_target, [node for node in nodes if node not in stated.values()])
        shared = source_roles.keys() & by_own_role.keys()
        in_role = {source_roles[role] for role in shared}
        of_role = {by_own_role[role] for role in shared}
        free = {plain_target[node]: node for node in reversed(nodes) if node not in of_role}
        return (
            lambda node: right.get(source[node]),
            lambda node: None if node in in_role else free.get(plain_source[node]),
            lambda node: by_own_role.get(by_role.get(node, "")),
        )

    ways = (
        same.get,
        lambda node: stated.get(by_role.get(node, "")),
        *by_names(of_target),
        *by_names(others),
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
    return JointMatch(
        ordered,
        tuple(node for node in sorted(of_source) if node not in ordered),
        shared,
        {role: ordered[node] for role, node in shared.items()},
    )


def match_same_hierarchy(source: Skeleton, target: Skeleton, chosen: Sequence[int]) -> dict[int, int]:
    """Return the target node of each chosen source node, by name; empty for different hierarchies.

    They agree if every chosen node, and its parent, if any, has the label (see `labels`) of a target node and its
    parent: as in a file exported from this character. Nodes that are no joints, and those with repeated names, then
    have their partners too.
    """
    found: dict[int, int] = {}
    by_label = {label: node for node, label in enumerate(labels(target))}
    for node in chosen:
        other, parent = by_label.get(source.names[node], -1), int(source.parents[node])
        other_parent = -1 if other < 0 else int(target.parents[other])
        if other < 0 or (parent >= 0 and by_label.get(source.names[parent], -1) != other_parent):
            return {}
        found[node] = other
    return found


def _match_by_name(
    aliases: Mapping[str, str], left: Mapping[str, int], right: Mapping[str, int]
) -> tuple[dict[int, int], set[int]]:
    """The pairs given by aliases, and the source nodes that aliases exclude."""
    pairs: dict[int, int] = {}
    excluded: set[int] = set()
    for name, other in aliases.items():
        if name not in left:
            raise NotFoundError(f"alias for '{name}', which the motion does not have", help=_suggest(name, left))
        if not other:
            excluded.add(left[name])
        elif other not in right:
            raise NotFoundError(f"alias '{name}' → '{other}', which is not there", help=_suggest(other, right))
        else:
            pairs[left[name]] = right[other]
    return pairs, excluded


def _suggest(name: str, names: Mapping[str, int]) -> str:
    found = difflib.get_close_matches(name, names, n=1)
    return f"did you mean '{found[0]}'?" if found else ""


def read_aliases(data: bytes) -> dict[str, str]:
    """Return target names by source name, from a JSON object or from CSV lines "source,target".

    An empty target omits the joint; in CSV, lines that begin with # are comments. Raises FormatError with the line.
    b"LeftArm,upperarm.l\\nLFingers,\\n" → {"LeftArm": "upperarm.l", "LFingers": ""}
    """
    if json_text.skip_mark(data).lstrip()[:1] == b"{":
        content = json_text.parse(json_text.skip_mark(data))
        for name, other in content.items():
            if not isinstance(other, str):
                raise FormatError(f"'{name}' has {other!r} (expected the name of a node)")
        return content
    found: dict[str, str] = {}
    rows = csv.reader(io.StringIO(decode_text(data)), strict=True)
    try:
        for cells in rows:
            if not cells or cells[0].startswith("#"):
                continue
            if len(cells) != 2 or not cells[0].strip():
                raise error_at(rows.line_num, f"{len(cells)} columns (expected source,target)")
            found[cells[0].strip()] = cells[1].strip()
    except csv.Error as error:
        raise error_at(rows.line_num, f"broken CSV ({error})") from None
    return found
