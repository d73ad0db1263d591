"""Table of Euler track formats: by name, by file extension and by magic bytes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from anim.errors import FormatError, RangeError
from anim.exchange.euler.convention import UNSPECIFIED, PartialConvention
from anim.exchange.euler.motion import Convention, EulerMotion
from anim.exchange.formats import bvh_reader, csv_reader, json_reader
from anim.exchange.formats.bvh_reader import BvhPosition


@dataclass(frozen=True, slots=True)
class TrackReadOptions:
    """Reader options: the convention, and the meaning of BVH's position channels."""

    stated: PartialConvention = UNSPECIFIED
    bvh_position: BvhPosition = BvhPosition.REPLACE


@dataclass(frozen=True, slots=True)
class TrackFormat:
    """One format: bytes → motion and motion → bytes.

    suffix: of its files. begins: True for the magic bytes of the format, tested in the table's order.
    has_units: True if lengths are in metres; otherwise in the file's own, unknown unit.
    """

    suffix: str
    read: Callable[[bytes, TrackReadOptions], EulerMotion]
    write: Callable[[EulerMotion, Convention], bytes]
    begins: Callable[[bytes], bool]
    has_units: bool


def _read_bvh(data: bytes, reading: TrackReadOptions) -> EulerMotion:
    if reading.stated != UNSPECIFIED:
        raise RangeError("`order`, `axes` and `unit` do not apply to a BVH, which specifies the order of every joint")
    return bvh_reader.read(data, position=reading.bvh_position)


def _curves(
    read: Callable[[bytes, PartialConvention], EulerMotion],
) -> Callable[[bytes, TrackReadOptions], EulerMotion]:
    def read_curves(data: bytes, reading: TrackReadOptions) -> EulerMotion:
        if reading.bvh_position is not BvhPosition.REPLACE:
            raise RangeError("`bvh_position` does not apply to curves without OFFSET (only to a BVH)")
        return read(data, reading.stated)

    return read_curves


TRACK_FORMATS = {
    "bvh": TrackFormat(".bvh", _read_bvh, bvh_reader.write, lambda head: head.upper().startswith(b"HIERARCHY"), False),
    "json": TrackFormat(".json", _curves(json_reader.read), json_reader.write, lambda head: head[:1] == b"{", True),
    "csv": TrackFormat(".csv", _curves(csv_reader.read), csv_reader.write, lambda head: b"," in head, True),
}


def of_path(path: str) -> TrackFormat | None:
    """Return the format of a file extension, None for an unknown one."""
    return next((each for each in TRACK_FORMATS.values() if path.lower().endswith(each.suffix)), None)


def of_content(data: bytes) -> TrackFormat:
    """Return the format of a file by its magic bytes. Raises FormatError for unknown ones."""
    if data[:4] == b"glTF":
        raise FormatError(f"is a glTF already (expected {', '.join(TRACK_FORMATS)})")
    head = data[:4096].replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    for each in TRACK_FORMATS.values():
        if each.begins(head):
            return each
    raise FormatError(f"starts with {data[:12]!r} (expected {', '.join(TRACK_FORMATS)})" if data else "is empty")
