"""Memory of prims that a USD layer composes: files with many prims are read, bombs of references are not composed."""

from __future__ import annotations

from typing import Any

import pytest

from anim.caches.formats import usd_prims
from anim.errors import UnsupportedError

GB = 10**9


def layer(text: str) -> Any:
    sdf = pytest.importorskip("pxr.Sdf")
    made = sdf.Layer.CreateAnonymous(".usda")
    assert made.ImportFromString("#usda 1.0\n" + text)
    return made


def check(made: Any, limit_bytes: int) -> None:
    paths: list[Any] = []
    made.Traverse("/", lambda path: paths.append(path) if usd_prims.has_arcs(made.GetObjectAtPath(path)) else None)
    usd_prims.check_size(made, paths, limit_bytes)


def prims(num: int, name: str = "p") -> str:
    return "".join(f'def Xform "{name}{i}" {{}}\n' for i in range(num))


def group(num: int) -> str:
    """A class of some prims."""
    return f'class Xform "group"\n{{\n{prims(num)}}}\n'


def doubled(levels: int, first: str = "references", second: str = "references") -> str:
    """Prims that refer twice to the one before: 2**(levels + 1) − 1 are composed below the last."""
    rows = [f'def "a" ({first} = </c{i}>) {{}}\ndef "b" ({second} = </c{i}>) {{}}\n' for i in range(levels)]
    return 'class "c0" {}\n' + "".join(f'class "c{i + 1}"\n{{\n{row}}}\n' for i, row in enumerate(rows))


def test_prims_of_the_layer_itself_take_nothing() -> None:
    """One reference made each of them count 8 kB: 125 000 prims were the most that a file could have."""
    check(layer(prims(3000) + 'def "r" (references = </p0>) {}'), 10_000)


def test_copies_of_a_group_are_counted() -> None:
    """15 references to a group of 100 prims take 1 kB a prim, and 4 kB a reference; usd-core takes half."""
    made = layer(group(100) + "".join(f'def "r{i}" (references = </group>) {{}}\n' for i in range(15)))
    check(made, 1_600_000)
    with pytest.raises(UnsupportedError, match="composes 1515 prims or more") as caught:
        check(made, 1_500_000)
    assert "which would take 0.00156 GB (limit 0.0015 GB)" in str(caught.value)
    assert "memory_limit" in caught.value.help


def test_a_thousand_references_to_a_hundred_prims_pass() -> None:
    check(layer(group(100) + "".join(f'def "r{i}" (references = </group>) {{}}\n' for i in range(1500))), GB)


@pytest.mark.parametrize("arcs", [("references", "references"), ("inherits", "specializes"), ("payload", "inherits")])
def test_references_in_references_are_refused(arcs: tuple[str, str]) -> None:
    """Of 15 levels usd-core composed 0.2 million prims in 11 s."""
    check(layer(doubled(8, *arcs)), GB)
    for levels in (15, 40):
        with pytest.raises(UnsupportedError, match="composes"):
            check(layer(doubled(levels, *arcs)), GB)


def test_the_default_prim_is_a_target() -> None:
    text = f'(\n    defaultPrim = "group"\n)\n{group(100)}' + 'def "r" (references = <>) {}\n'
    with pytest.raises(UnsupportedError, match=r"composes \d+ prims or more"):
        check(layer(text), 100_000)
    check(layer(text), 110_000)


def test_a_circle_ends() -> None:
    """usd-core leaves out the reference that closes it."""
    check(layer('def "a"\n{\ndef "b" (references = </a>) {}\n}\n'), GB)


def test_references_below_a_thousand_prims_are_counted() -> None:
    """They were not below 300."""
    opened = "".join(f'def Xform "p{i}"\n{{\n' for i in range(1000))
    made = layer(doubled(20) + opened + 'def "r" (references = </c20>) {}\n' + "}\n" * 1000)
    with pytest.raises(UnsupportedError, match="composes"):
        check(made, GB)


def test_counting_ends_with_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each path of 16 names, a or b, is a set of specs of its own: there are 65 536."""
    asked: list[Any] = []
    find = usd_prims._Counter._find

    def count(*args: Any) -> Any:
        asked.append(args)
        return find(*args)

    monkeypatch.setattr(usd_prims._Counter, "_find", count)
    with pytest.raises(UnsupportedError, match="composes"):
        check(layer(remembered(16)), 10**7)
    assert len(asked) < 5000


def remembered(levels: int) -> str:
    """Prims with children a and b, where b refers to one more prim, which all prims below it have too."""
    rows = ['class "q0" {}\n', *(f'class "t0_{j}" {{}}\n' for j in range(levels + 1))]
    for i in range(1, levels + 1):
        both = f"</q{i - 1}>, </t{i - 1}_0>"
        rows.append(
            f'class "q{i}"\n{{\ndef "a" (references = </q{i - 1}>) {{}}\ndef "b" (references = [{both}]) {{}}\n}}\n'
        )
        for j in range(levels - i + 1):
            one = f"references = </t{i - 1}_{j + 1}>"
            rows.append(f'class "t{i}_{j}"\n{{\ndef "a" ({one}) {{}}\ndef "b" ({one}) {{}}\n}}\n')
    return "".join(rows)
