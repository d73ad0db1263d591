"""Faults of OBJ, PLY and STL files, named by line and vertex as the file counts them."""

from __future__ import annotations

import numpy as np
import pytest

from anim.caches.formats import mesh_frame
from anim.errors import FormatError

VERTICES = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
HEADER = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
)
POINTS = "0 0 0\n1 0 0\n0 1 0\n"
MANY = "9" * 5000
CUT = "'99999999999999999999…'"
STL = "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 x\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"
DAMAGED = "is no .ply that can be read: damaged, or not as its beginning says"
NO_NUMBER = "is no number of a vertex (expected 1 or more, or -1 or less)"


@pytest.mark.parametrize(
    ("ending", "text", "problem"),
    [
        (".obj", f"{VERTICES}f 1 2 7\n", "line 4: a face uses vertex 7 of 3"),
        (".obj", f"{VERTICES}f 1 2 3\nf 1 2 -9\n", "line 5: a face uses vertex -9, but 3 are before it"),
        (".obj", f"{VERTICES}f 1 2 0\nv 0 0 1\n", f"line 4: '0' {NO_NUMBER}"),
        (".obj", f"{VERTICES}f 1 2 1.5\n", f"line 4: '1.5' {NO_NUMBER}"),
        (".obj", f"{VERTICES}f 1 2 /3\n", f"line 4: '' {NO_NUMBER}"),
        (".obj", f"{VERTICES}f 1 2 {MANY}\n", f"line 4: {CUT} {NO_NUMBER}"),
        (".obj", f"# x\nv 0 x 0\n{VERTICES}", "line 2: 'x' is no number"),
        (".obj", f"v 0 0\n{VERTICES}", "line 1: has 2 numbers after v (expected 3)"),
        (".ply", f"{HEADER}{POINTS}3 0 1 7\n", "a face uses vertex 7 of 3 (counted from 0)"),
        (".ply", f"{HEADER}{POINTS}3 0 1 -1\n", "a face uses vertex -1 of 3 (counted from 0)"),
        (".ply", f"{HEADER}{POINTS}3 0 1 {MANY}\n", f"line 13: {CUT} is too large a number"),
        (".ply", f"{HEADER}{POINTS}3 0 1 {2**64}\n", f"line 13: '{2**64}' is too large a number"),
        (".ply", f"{HEADER}{POINTS.replace('1 0 0', '1 x 0')}3 0 1 2\n", "line 11: 'x' is no number"),
        (".ply", HEADER.replace("vertex 3", f"vertex {MANY}"), f"line 3: {CUT} is too large a number"),
        (".ply", HEADER.replace("vertex 3", "vertex x"), "line 3: 'x' is no number"),
        (".ply", f"{HEADER}{POINTS.replace('1 0 0', '1 0')}3 0 1 2\n", DAMAGED),  # was a traceback
        (".ply", "hello", DAMAGED),
        (".stl", STL, "line 5: 'x' is no number"),
    ],
)
def test_faults_are_named_as_the_file_counts(ending: str, text: str, problem: str) -> None:
    with pytest.raises(FormatError) as caught:
        mesh_frame.read(text.encode(), ending)
    assert str(caught.value) == problem


def test_vertices_are_counted_from_the_end_too() -> None:
    frame = mesh_frame.read(f"f 1 2 4\n{VERTICES}v 0 0 1\nf -4/1 -3/2 -1/9\n".encode(), ".obj")
    assert frame.faces.tolist() == [[0, 1, 3], [0, 1, 3]]
    assert np.array_equal(frame.positions[3], [0, 0, 1])
