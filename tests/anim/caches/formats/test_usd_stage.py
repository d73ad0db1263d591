"""Prims of a stage are defined in one change."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.caches.formats.usd_face_materials import face_materials
from anim.caches.formats.usd_stage import define_prims

pytest.importorskip("pxr", reason="usd-core is not installed")


def test_prims_are_composed_once() -> None:
    from pxr import Tf, Usd

    stage = Usd.Stage.CreateInMemory()
    changes = list[int]()

    def changed(notice: Any, sender: Any) -> None:
        changes.append(len(notice.GetResyncedPaths()))

    listener = Tf.Notice.Register(Usd.Notice.ObjectsChanged, changed, stage)
    define_prims(stage, [("/root", "Xform"), *((f"/root/m{i}", "Mesh") for i in range(20))])
    listener.Revoke()
    assert len(changes) == 1
    assert [(each.GetName(), each.GetTypeName()) for each in stage.Traverse()][:2] == [
        ("root", "Xform"),
        ("m0", "Mesh"),
    ]
    assert len(stage.GetPrimAtPath("/root").GetChildren()) == 20


def test_faces_of_each_material_in_order() -> None:
    faces = np.array([[0, 1, 2], [6, 7, 8], [3, 4, 5], [0, 2, 1]])
    primitives = [({"material": 1}, (0, 3)), ({}, (3, 6)), ({"material": 1}, (6, 9))]
    found = face_materials({"materials": [{}, {}]}, faces, primitives)
    assert found.numbers == [-1, 1]
    assert [each.tolist() for each in found.faces] == [[2], [0, 1, 3]]


def test_faces_without_a_material() -> None:
    assert face_materials({}, np.array([[0, 1, 2]]), [({}, (0, 3))]) == ([], [])
    assert face_materials({}, np.empty((0, 3), np.int64), []) == ([], [])
