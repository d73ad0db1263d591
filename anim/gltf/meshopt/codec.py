"""Encode and decode buffer views of EXT_/KHR_meshopt_compression with the package `meshopt`."""

from __future__ import annotations

import numpy as np

from anim.errors import FormatError, UnsupportedError
from anim.gltf.document import Bytes, Json

MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")
FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR")
VERSIONS = {"EXT_meshopt_compression": 0, "KHR_meshopt_compression": 1}  # version of the attribute bitstream
MAX_STRIDE_BYTES = 256  # bytes per row, by both extensions


def row_size(key_size: int, element_size: int) -> int:
    """Return the bytes per row of a stream: a whole key, or one element for keys above the maximum stride.

    Both are in bytes; an element is a multiple of 4, a key one or more of them (weights have an element per target).
    Rows of whole keys compress better: each value is predicted from the same one of the previous key.
    (40 weights, 160, 4) → 160; (65 weights, 260, 4) → 4
    """
    return key_size if key_size % element_size == 0 and key_size <= MAX_STRIDE_BYTES else element_size


def encode(rows: Bytes, extension: str) -> bytes:
    """Return rows (count, byteStride), already filtered, as a stream of mode ATTRIBUTES."""
    from meshopt import encode_gltf_buffer

    return bytes(encode_gltf_buffer(rows, "ATTRIBUTES", VERSIONS[extension]))


def decode(stored: Bytes, about: Json) -> Bytes:
    """Return the decoded bytes (count × byteStride,) of a compressed view.

    stored: the compressed bytes. about: the extension's object: byteStride, count, mode, filter.
    Raises FormatError if the stream does not match the object, UnsupportedError for an unknown mode.
    """
    mode, chosen_filter = about.get("mode"), about.get("filter", "NONE")
    if mode not in MODES or chosen_filter not in FILTERS:
        raise UnsupportedError(f"meshopt mode {mode!r} with filter {chosen_filter!r} is not known")
    count, stride = about["count"], about["byteStride"]
    _check_stride(mode, chosen_filter, stride, count)
    from meshopt import decode_gltf_buffer

    try:
        decoded = decode_gltf_buffer(
            stored.tobytes(), count, stride, mode, None if chosen_filter == "NONE" else chosen_filter
        )
    except (ValueError, RuntimeError) as error:
        raise FormatError(f"meshopt stream is broken ({error})") from None
    plain = np.ascontiguousarray(decoded).reshape(-1).view(np.uint8)
    if len(plain) != count * stride:
        plain = _cast_indices(np.asarray(decoded), count, stride)
    return plain


def _check_stride(mode: str, chosen_filter: str, stride: int, count: int) -> None:
    if mode == "ATTRIBUTES":
        good = stride % 4 == 0 and stride <= MAX_STRIDE_BYTES
        good &= {"OCTAHEDRAL": stride in (4, 8), "QUATERNION": stride == 8, "COLOR": stride in (4, 8)}.get(
            chosen_filter, True
        )
    else:
        good = stride in (2, 4) and chosen_filter == "NONE" and (mode == "INDICES" or count % 3 == 0)
    if not good:
        raise FormatError(f"meshopt byteStride {stride} and count {count} don't fit {mode} with filter {chosen_filter}")


def _cast_indices(indices: np.ndarray[tuple[int, ...], np.dtype[np.uint32]], count: int, stride: int) -> Bytes:
    """Convert 32-bit indices to the view's 2 or 4 bytes."""
    flat = indices.reshape(-1)
    if len(flat) != count:
        raise FormatError(f"meshopt stream holds {len(flat)} indices (expected {count})")
    return flat.astype(f"<u{stride}").view(np.uint8)
