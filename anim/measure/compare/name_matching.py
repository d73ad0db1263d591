"""Matching of nodes and clips of two files: by name, by the letters of names, then in order."""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Sequence

import numpy as np

from anim.arrays import Ints, group_indices
from anim.model import Scene, Skeleton


def match_by_name(old: Sequence[str], new: Sequence[str]) -> Ints:
    """Return for each name of `old` (N,) the index of the same name in `new`, −1 without one.

    If a name occurs several times, the first belongs to the first, the second to the second. Empty ones match nothing.
    match_by_name(["a", "b", "a"], ["b", "a"]) → 1, 0, −1
    """
    waiting: dict[str, list[int]] = defaultdict(list)
    for i, name in enumerate(new):
        waiting[name].append(i)
    waiting[""].clear()
    for each in waiting.values():
        each.reverse()
    return np.array([waiting[name].pop() if waiting.get(name) else -1 for name in old], np.int64)


def match_by_letters(old: Sequence[str], new: Sequence[str]) -> Ints:
    """Return for each name of `old` (N,) its index in `new`, −1 without one: by name, or by its letters and digits.

    Players and tools replace characters such as "." in names: three.js has "FootL" for "Foot.L". By letters go names
    that the other list lacks or has more or less often, if equally many of each list have these letters.
    match_by_letters(["hip", "Foot.L", "a.b", "ab"], ["Foot_L", "hip", "a_b"]) → 1, 0, −1, −1
    """
    guesses = {*ambiguous_names(old, new)}
    found = match_by_name(_without(old, guesses), _without(new, guesses))
    before = _by_letters((i, name) for i, name in enumerate(old) if found[i] < 0)
    taken = set(found.tolist())
    after = _by_letters((i, name) for i, name in enumerate(new) if i not in taken)
    for letters in before.keys() & after.keys() - {""}:
        if len(before[letters]) == len(after[letters]):
            found[before[letters]] = after[letters]
    taken = set(found.tolist())
    rest = match_by_name(old, ["" if i in taken else name for i, name in enumerate(new)])
    return np.where(found >= 0, found, rest)


def _without(names: Sequence[str], left_out: set[str]) -> list[str]:
    return ["" if name in left_out else name for name in names]


def _by_letters(names: Iterable[tuple[int, str]]) -> dict[str, list[int]]:
    result: dict[str, list[int]] = defaultdict(list)
    for i, name in names:
        result["".join(filter(str.isalnum, name))].append(i)
    return result


def ambiguous_names(old: Sequence[str], new: Sequence[str]) -> list[str]:
    """Return the common names that occur a different number of times in both: their matches are guesses.

    ambiguous_names(["run", "run", "walk"], ["walk", "run"]) → ["run"]
    """
    before, after = Counter(old), Counter(new)
    return [name for name, count in before.items() if name and after[name] not in (0, count)]


def match_by_name_then_order(old: Sequence[str], new: Sequence[str]) -> Ints:
    """Return for each name of `old` (N,) its index in `new`, −1 without one: by name, then in order.

    In order only if one of both has no name, or if no name is common: two different names beside matched ones are two
    different things. match_by_name_then_order(["walk", ""], ["run", "walk"]) → 1, 0
    """
    found = match_by_name(old, new)
    taken = set(found.tolist())
    left = deque(i for i in range(len(new)) if i not in taken)
    nothing_found = not (found >= 0).any()
    for i, name in enumerate(old):
        if found[i] < 0 and left and (nothing_found or not name or not new[left[0]]):
            found[i] = left.popleft()
    return found


def match_nodes(old: Scene, new: Scene) -> Ints:
    """Return for each node of `old` (N,) its index in `new`, −1 without one.

    By name, where several have it by the names above them too; then by its letters and digits; then joints in order of
    skins of equal size; then in order among the children of one parent, if one of both has no name or no name is
    common.
    """
    return _Nodes(old.skeleton, new.skeleton).joined(_skins(old), _skins(new))


class _Nodes:
    """Nodes of two skeletons during matching."""

    def __init__(self, old: Skeleton, new: Skeleton) -> None:
        self._old, self._new = old, new
        self._children = tuple(group_indices(each.parents.tolist()) for each in (old, new))
        self.found: list[int] = match_by_letters(old.names, new.names).tolist()
        self._match_paths()
        self._taken = {node for node in self.found if node >= 0}
        self._renamed = not (match_by_name(old.names, new.names) >= 0).any()

    def _match_paths(self) -> None:
        """Match nodes of repeated names by the names from the root on, where these are the same set in both files."""
        paths: dict[tuple[int, str], int] = {}
        before_counts, after_counts = Counter(self._old.names), Counter(self._new.names)
        before = _by_name(self._old.names, _path_ids(self._old, paths))
        after = _by_name(self._new.names, _path_ids(self._new, paths))
        for name, nodes in before.items():
            partners = after.get(name, {})
            are_distinct = before_counts[name] == after_counts[name] == len(nodes)
            if len(nodes) > 1 and are_distinct and nodes.keys() == partners.keys():
                for path, node in nodes.items():
                    self.found[node] = partners[path]

    def joined(self, old_skins: list[Ints], new_skins: list[Ints]) -> Ints:
        for one, other in zip(old_skins, new_skins, strict=False):
            if len(one) == len(other):
                self._join(one.tolist(), other.tolist())
        self._join_children(-1, -1)
        for parent in np.concatenate([np.empty(0, np.int64), *self._old.levels()]).tolist():
            if self.found[parent] >= 0 and parent in self._children[0]:
                self._join_children(parent, self.found[parent])
        return np.array(self.found, np.int64)

    def _join_children(self, parent: int, partner: int) -> None:
        """Match the remaining children of two nodes in order if they are equally many: parents first."""
        old_children, new_children = self._children
        one = [i for i in old_children.get(parent, ()) if self.found[i] < 0]
        other = [i for i in new_children.get(partner, ()) if i not in self._taken]
        inner, others_inner = [i for i in one if i in old_children], [i for i in other if i in new_children]
        if len(inner) == len(others_inner):
            self._join(inner, others_inner)
            self._join_equal([i for i in one if i not in old_children], [i for i in other if i not in new_children])
        else:
            self._join_equal(one, other)

    def _join_equal(self, old: list[int], new: list[int]) -> None:
        if len(old) == len(new):
            self._join(old, new)

    def _join(self, old: list[int], new: list[int]) -> None:
        for one, other in zip(old, new, strict=True):
            is_free = self.found[one] < 0 and other not in self._taken
            if is_free and (self._renamed or not self._old.names[one] or not self._new.names[other]):
                self.found[one] = other
                self._taken.add(other)


def _path_ids(skeleton: Skeleton, known: dict[tuple[int, str], int]) -> list[int]:
    """Return for each node (N,) the index of its path, the names from the root on.

    known: indices by the parent's index, −1 for none, and the name; added to.
    """
    found, parents = [-1] * len(skeleton), skeleton.parents.tolist()
    for node in np.concatenate([np.empty(0, np.int64), *skeleton.levels()]).tolist():
        parent = parents[node]
        key = (found[parent] if parent >= 0 else -1, skeleton.names[node])
        found[node] = known.setdefault(key, len(known))
    return found


def _by_name(names: Sequence[str], paths: Sequence[int]) -> dict[str, dict[int, int]]:
    """Return nodes by name and path; nodes without a name are left out."""
    result: dict[str, dict[int, int]] = defaultdict(dict)
    for node, (name, path) in enumerate(zip(names, paths, strict=True)):
        if name:
            result[name][path] = node
    return result


def _skins(scene: Scene) -> list[Ints]:
    """Joints (J,) of the skins in use, each once, in order."""
    skins = dict.fromkeys(each.skin for each in scene.instances if each.skin is not None)
    return [skin.joints for skin in skins]
