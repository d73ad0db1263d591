"""The solution of a clip, and its size in bytes."""

from __future__ import annotations

from dataclasses import dataclass

from anim.model import Clip, Interpolation, Track
from anim.optimization.tracks.quantization import EncodedKeys, Encoding

COMPONENTS = {Interpolation.STEP: 1, Interpolation.LINEAR: 1, Interpolation.CUBICSPLINE: 3}  # values per key
SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # bytes, by glTF's component type


@dataclass(frozen=True, slots=True)
class Solution:
    """A clip in fewer bytes.

    stored: encoded keys of each track. dropped: indices of the source's tracks without a channel.
    """

    clip: Clip
    stored: tuple[EncodedKeys, ...]
    dropped: tuple[int, ...]

    def size(self, coding: Encoding) -> float:
        """Return the approximate number of bytes of the clip."""
        tracks, prices = self.clip.tracks, coding.byte_costs
        axes = {id(track.times): len(track.times) for track in tracks}
        text = sum(prices.single_key if len(track.times) == 1 else prices.track for track in tracks)
        times = sum(prices.axis + 4 * length for length in axes.values())
        plain = sum(value_bytes(track) for track, keys in zip(tracks, self.stored, strict=True) if not keys.codes)
        return text + times + plain + coding.size([keys for keys in self.stored if keys.codes])


def value_bytes(track: Track) -> int:
    """Return the bytes of a track's values, tangents included, in its storage format."""
    return COMPONENTS[track.interpolation] * SIZES[track.storage.component_type] * track.values.size
