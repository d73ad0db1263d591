"""Binds of VRM expressions to morph targets, which a bake replaces by targets of its own."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator

from anim.gltf.document import Json, json_array
from anim.units import plural

_MORPHS_0, _MORPHS_1 = "binds", "morphTargetBinds"  # of VRM 0.x and 1.0


def drop_binds(json: Json, source: Json, nodes: Collection[int]) -> None:
    """Remove binds to morph targets that there are no more, in place; the extensions are replaced whole.

    An index that stayed would name the shape of a frame. json: edited, with a list of meshes of which those of `source`
    that stay are the same objects. nodes: those whose meshes were baked or left out.
    """
    meshes, old = json_array(json, "meshes"), json_array(source, "meshes")

    def is_kept(bind: Json) -> bool:
        if "node" in bind:
            return not isinstance(bind["node"], int) or bind["node"] not in nodes
        i = bind.get("mesh")
        return not (isinstance(i, int) and 0 <= i < len(old)) or meshes[i] is old[i]

    extensions = json.get("extensions")
    if isinstance(extensions, dict):
        changed = {name: _EDITS[name](extensions[name], is_kept) for name in _EDITS.keys() & extensions.keys()}
        if any(changed[name] is not extensions[name] for name in changed):
            json["extensions"] = {**extensions, **changed}


def lost_bind_notes(before: Json, after: Json) -> tuple[str, ...]:
    """Return a note on the expressions that lost binds to morph targets; none if none did."""
    found = list(_binds(before))
    left = dict(_binds(after))
    lost = [name for name, count in found if left.get(name, 0) < count]
    if not lost:
        return ()
    return (f"{plural(len(lost), 'VRM expression')} without morph targets now: the bake replaces them",)


def _binds(json: Json) -> Iterator[tuple[str, int]]:
    """The key of each expression, and its number of binds to morph targets."""
    extensions = json.get("extensions")
    extensions = extensions if isinstance(extensions, dict) else {}
    for i, group in enumerate(_groups(extensions.get("VRM"))):
        yield f"VRM/{i}", len(json_array(group, _MORPHS_0))
    for kind, name, expression in _expressions(extensions.get("VRMC_vrm")):
        yield f"VRMC_vrm/{kind}/{name}", len(json_array(expression, _MORPHS_1))


def _groups(extension: object) -> list[Json]:
    master = extension.get("blendShapeMaster") if isinstance(extension, dict) else None
    groups = master.get("blendShapeGroups") if isinstance(master, dict) else None
    return [each for each in groups if isinstance(each, dict)] if isinstance(groups, list) else []


def _expressions(extension: object) -> Iterator[tuple[str, str, Json]]:
    kinds = extension.get("expressions") if isinstance(extension, dict) else None
    for kind, named in kinds.items() if isinstance(kinds, dict) else ():
        for name, expression in named.items() if isinstance(named, dict) else ():
            if isinstance(expression, dict):
                yield kind, name, expression


def _edit_groups(extension: Json, is_kept: Callable[[Json], bool]) -> Json:
    """The extension VRM without binds that are not kept."""
    if not _groups(extension):
        return extension
    groups = extension["blendShapeMaster"]["blendShapeGroups"]
    new = [_without(each, _MORPHS_0, is_kept) if isinstance(each, dict) else each for each in groups]
    if all(a is b for a, b in zip(groups, new, strict=True)):
        return extension
    return {**extension, "blendShapeMaster": {**extension["blendShapeMaster"], "blendShapeGroups": new}}


def _edit_expressions(extension: Json, is_kept: Callable[[Json], bool]) -> Json:
    """The extension VRMC_vrm without binds that are not kept."""
    new = {
        (kind, name): changed
        for kind, name, old in _expressions(extension)
        if (changed := _without(old, _MORPHS_1, is_kept)) is not old
    }
    if not new:
        return extension
    kinds = extension["expressions"]
    edited = {
        kind: {name: new.get((kind, name), each) for name, each in named.items()} if isinstance(named, dict) else named
        for kind, named in kinds.items()
    }
    return {**extension, "expressions": edited}


_EDITS = {"VRM": _edit_groups, "VRMC_vrm": _edit_expressions}


def _without(expression: Json, key: str, is_kept: Callable[[Json], bool]) -> Json:
    """The expression without the binds that are not kept; itself if all are."""
    binds = expression.get(key)
    if not isinstance(binds, list):
        return expression
    kept = [each for each in binds if not isinstance(each, dict) or is_kept(each)]
    if len(kept) == len(binds):
        return expression
    changed = {**expression, key: kept}
    if not kept and key == _MORPHS_1:  # the schema of VRM 1.0 allows an absent list; readers of 0.x expect one
        del changed[key]
    return changed
