"""NPZ: numpy alone reads it, numpy alone writes it, and nothing is lost."""

from __future__ import annotations

import io
import json
import zipfile

import numpy as np
import pytest

from anim.caches.storage import Memory
from anim.errors import FormatError
from tests.anim.caches.making import FACES, PARTS, cache, normals_of, opened, positions_of, written

REST = (positions_of(cache())[0].astype(np.float64) + 0.5).tolist()


def test_numpy_reads_it() -> None:
    source = cache()
    files, _ = written(source, "a.npz")
    whole = source.load_all()
    with np.load(io.BytesIO(files.files["a.npz"]), allow_pickle=False) as arrays:
        assert arrays["positions"].dtype == np.float32
        assert (arrays["positions"] == whole.positions).all()
        assert (arrays["normals"] == whole.normals).all()
        assert (arrays["times"] == source.times).all()
        assert (arrays["faces"] == FACES).all()
        assert arrays["rest"].tolist() == REST
        meta = json.loads(str(arrays["meta"]))
    assert meta["up"] == "y"
    assert meta["parts"][1] == {"name": "two", "vertices": [4, 9], "faces": [2, 4], "node": 5, "material": 1}


def test_back_again_nothing_is_lost() -> None:
    source = cache()
    back = opened(written(source, "a.npz")[0])
    assert (back.times == source.times).all()
    assert (positions_of(back) == positions_of(source)).all()
    assert (normals_of(back) == normals_of(source)).all()
    assert back.parts == PARTS
    assert back.rest is not None
    assert back.rest.tolist() == REST
    assert written(back, "a.npz")[0].files == written(source, "a.npz")[0].files


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_what_numpy_saved_is_read(save: object) -> None:
    positions = np.random.default_rng(1).normal(size=(4, 3, 3))  # float64
    out = io.BytesIO()
    save(out, positions=positions, times=np.arange(4.0), faces=[[0, 1, 2]])  # type: ignore[operator]
    back = opened(Memory("b.npz", {"b.npz": out.getvalue()}))
    assert (positions_of(back) == positions.astype(np.float32)).all()
    assert not back.has_normals
    assert back.rest is None


def test_no_member_is_compressed_and_none_has_a_date_of_today() -> None:
    files, _ = written(cache(), "a.npz")
    with zipfile.ZipFile(io.BytesIO(files.files["a.npz"])) as archive:
        assert {(member.compress_type, member.date_time[0]) for member in archive.infolist()} == {(0, 1980)}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"times": None}, "no array 'times'"),
        ({"positions": None}, "no array 'positions'"),
        ({"positions": np.zeros((7, 9))}, "expected \\(F, V, 3\\)"),
        ({"times": np.arange(3.0)}, "don't fit"),
        ({"faces": np.array([[0, 1, 9]])}, "vertex 9 of 9"),
        ({"faces": np.array([[0, 1, -1]])}, "vertex -1 of 9"),
        ({"positions": np.full((7, 9, 3), np.nan)}, "NaN"),
        ({"meta": np.array("{")}, "no JSON"),
        ({"meta": np.array('{"parts": [1]}')}, "not understood"),
        ({"times": np.array(["a"] * 7, dtype=object)}, "damaged|not handled"),
    ],
)
def test_what_is_wrong_is_said(change: dict[str, np.ndarray | None], words: str) -> None:
    arrays = {"positions": np.zeros((7, 9, 3), "f4"), "times": np.arange(7.0), "faces": FACES, **change}
    out = io.BytesIO()
    np.savez(out, **{name: array for name, array in arrays.items() if array is not None})  # type: ignore[arg-type]
    with pytest.raises(FormatError, match=words):
        opened(Memory("b.npz", {"b.npz": out.getvalue()})).load_all()


def test_a_zip_that_is_not_understood_is_no_npz() -> None:
    data = written(cache(), "a.npz")[0].files["a.npz"]
    needed = data.index(b"PK\x01\x02") + 6  # the version that is needed to extract the first member
    later = data[:needed] + b"\xff\x00" + data[needed + 2 :]
    for name, changed, words in (("a.npz", later, "zip file version 25.5"), ("a.npz", data[:9], "not a zip file")):
        with pytest.raises(FormatError, match=rf"is no \.npz \(.*{words}"):
            opened(Memory(name, {name: changed}))
