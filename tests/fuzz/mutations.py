"""Mutations of files: of their bytes, of JSON, of numbers in buffers, of words in text, of arrays in a .npz."""

from __future__ import annotations

import io
import json
import re
import struct
import tomllib
import zipfile
from collections.abc import Callable
from random import Random
from typing import Any

VALUES: tuple[Any, ...] = (  # in place of any value of a JSON
    None, True, False, 0, 1, -1, 2, 3, 255, 65535, 65536, 2**31 - 1, 2**31, 2**53, 2**64, 10**30, -(10**200), 0.5, -0.5,
    1e-45, 1e-320, 1e38, 3.5e38, 1e300, "", "x", "\0", "\ud800", "x" * 3000, "../a", "/", [], {}, [[]], [None], [0],
    [-1], [1e38], [0] * 3, [0] * 4, [1] * 16, ["x"], {"x": 1},
)  # fmt: skip
WORDS = (  # in place of a word of a text
    b"", b"0", b"-1", b"1", b"9" * 20, b"9" * 5000, b"1e400", b"1e300", b"1e-320", b"1e38", b"nan", b"inf", b"-inf",
    b"NaN", b"0x10", b"1_0", b"x", b"\0", b"\xff", b"\xe2\x98\x85", b"{", b"}", b"[", b"]", b",", b",,", b"\"", b"'",
    b"/", b"//", b"\x1c", b"#", b"\n", b"x" * 3000,
)  # fmt: skip
FLOATS = (0.0, -0.0, 1.0, -1.0, 1e-45, 1e-30, 1e19, 1e30, 3.4e38, -3.4e38, float("nan"), float("inf"), float("-inf"))
INTEGERS = (0, 1, 7, 127, 128, 255)
SPLIT = re.compile(rb"([\s,:;=]+)")

Mutate = Callable[[bytes, Random], bytes]


def mutate_bytes(data: bytes, chosen: Random) -> bytes:
    """Return data with a few bytes changed, or a part cut, repeated or moved."""
    found = bytearray(data)
    for _ in range(chosen.choice((1, 1, 1, 2, 4, 16))):
        at = chosen.randrange(len(found) + 1)
        end = min(len(found), at + chosen.choice((1, 1, 2, 4, 8, 64, 1000)))
        match chosen.randrange(6):
            case 0 if at < len(found):
                found[at] ^= 1 << chosen.randrange(8)
            case 1 if at < len(found):
                found[at] = chosen.choice(INTEGERS)
            case 2:
                del found[at:end]
            case 3:
                found[at:at] = found[at:end]
            case 4:
                found[at:end] = bytes(chosen.randrange(256) for _ in range(end - at))
            case _ if chosen.random() < 0.2:
                del found[at:]
    return bytes(found)


def mutate_json(document: Any, chosen: Random) -> None:
    """Change values of a JSON in place: other ones, those of elsewhere, none, or one more."""
    values = list(places(document))
    for _ in range(chosen.choice((1, 1, 1, 2, 3))):
        parent, key = chosen.choice(values)
        try:
            match chosen.randrange(6):
                case 0:
                    del parent[key]
                case 1 if isinstance(parent, list):
                    parent.insert(key, parent[key])
                case 2:
                    other, name = chosen.choice(values)
                    parent[key] = json.loads(json.dumps(other[name]))
                case 3 if type(parent[key]) in (int, float):
                    parent[key] += chosen.choice((-1, 1, 2, 100))
                case _:
                    parent[key] = json.loads(json.dumps(chosen.choice(VALUES)))
        except (KeyError, IndexError):  # gone by a change before
            continue


def places(value: Any) -> Any:
    """Yield container and key of each value of a JSON."""
    for key in value if isinstance(value, dict) else range(len(value)):
        yield value, key
        if isinstance(value[key], dict | list):
            yield from places(value[key])


def mutate_floats(data: bytes, chosen: Random) -> bytes:
    """Return data with some aligned float32 replaced by odd ones."""
    found = bytearray(data)
    for _ in range(chosen.choice((1, 1, 2, 8))):
        if len(found) >= 4:
            struct.pack_into("<f", found, 4 * chosen.randrange(len(found) // 4), chosen.choice(FLOATS))
    return bytes(found)


def mutate_glb(data: bytes, chosen: Random) -> bytes:
    """Return a GLB with its JSON, its numbers or its bytes changed; the chunks' lengths fit for the first two."""
    kind = chosen.randrange(10)
    if kind == 0:
        return mutate_bytes(data, chosen)
    size = int.from_bytes(data[12:16], "little")
    content, binary = data[20 : 20 + size], data[28 + size :]
    if kind < 7:
        document = json.loads(content)
        mutate_json(document, chosen)
        content = json.dumps(document).encode()
    else:
        binary = mutate_floats(binary, chosen)
    content += b" " * (-len(content) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(content) + len(binary))
    first, second = struct.pack("<I4s", len(content), b"JSON"), struct.pack("<I4s", len(binary), b"BIN\0")
    return head + first + content + second + binary


def mutate_json_file(data: bytes, chosen: Random) -> bytes:
    """Return a JSON text with values, words or bytes changed."""
    if chosen.random() < 0.3:
        return mutate_text(data, chosen)
    document = json.loads(data)
    mutate_json(document, chosen)
    return json.dumps(document).encode()


def mutate_lines(data: bytes, chosen: Random) -> bytes:
    """Return lines of JSON with one of them changed."""
    if chosen.random() < 0.3:
        return mutate_text(data, chosen)
    lines = data.splitlines()
    at = chosen.randrange(len(lines))
    lines[at] = mutate_json_file(lines[at], chosen)
    return b"\n".join(lines) + b"\n"


def mutate_toml(data: bytes, chosen: Random) -> bytes:
    """Return settings with values, words or bytes changed."""
    if chosen.random() < 0.5:
        return mutate_text(data, chosen)
    document = tomllib.loads(data.decode())
    mutate_json(document, chosen)
    rows = [f"{json.dumps(key)} = {_toml(value)}\n" for key, value in document.items()]
    return "".join(rows).encode("utf-8", "surrogatepass")


def _toml(value: Any) -> str:
    """A value of JSON as one of TOML, which has no null."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return "nan" if value is None else json.dumps(value)


def mutate_text(data: bytes, chosen: Random) -> bytes:
    """Return a text with words or lines changed."""
    if chosen.random() < 0.2:
        return mutate_bytes(data, chosen)
    if chosen.random() < 0.3:
        lines = data.split(b"\n")
        for _ in range(chosen.choice((1, 1, 3))):
            at, other = chosen.randrange(len(lines)), chosen.randrange(len(lines))
            lines[at:at] = [lines[other]] * chosen.randrange(3)
            if len(lines) > 1:
                del lines[chosen.randrange(len(lines))]
        return b"\n".join(lines)
    words = SPLIT.split(data)
    for _ in range(chosen.choice((1, 1, 2, 4))):
        at = 2 * chosen.randrange((len(words) + 1) // 2)
        words[at] = chosen.choice(WORDS) if chosen.random() < 0.8 else chosen.choice(words)
    return b"".join(words)


def mutate_npz(data: bytes, chosen: Random) -> bytes:
    """Return a .npz with one array changed: its header, its numbers, or its bytes."""
    if chosen.random() < 0.2:
        return mutate_bytes(data, chosen)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = chosen.choice(list(members))
    body = members[name]
    head, numbers = body[:128], body[128:]
    match chosen.randrange(4):
        case 0:
            members[name] = head[:10] + mutate_text(head[10:], chosen).ljust(118)[:118] + numbers
        case 1:
            members[name] = head + mutate_floats(numbers, chosen)
        case 2:
            del members[name]
        case _:
            members[name] = mutate_bytes(body, chosen)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for each, content in members.items():
            archive.writestr(each, content)
    return out.getvalue()


MUTATIONS: dict[str, Mutate] = {
    ".glb": mutate_glb,
    ".gltf": mutate_json_file,
    ".json": mutate_json_file,
    ".jsonl": mutate_lines,
    ".toml": mutate_toml,
    ".npz": mutate_npz,
    ".bvh": mutate_text,
    ".csv": mutate_text,
    ".obj": mutate_text,
    ".usda": mutate_text,
}


def mutate(name: str, data: bytes, chosen: Random) -> bytes:
    """Return the content of a file of this name, changed in a way that suits its format."""
    ending = name[name.rindex(".") :]
    return MUTATIONS.get(ending, mutate_bytes)(data, chosen)
