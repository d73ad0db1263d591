"""`gltf-anim render`: a clip as a filmstrip."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import PurePath
from typing import Annotated

import numpy as np
import typer

from anim.arrays import Floats
from anim.caches.formats import flipbook_reader
from anim.caches.options import ReadOptions
from anim.caches.registry import CACHE_FORMATS, SIGNATURE_BYTES, reader_for, sniff_format
from anim.caches.storage import Memory, suffix
from anim.files import resolver
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.io.buffers import Resolve
from anim.gltf.reading import reader
from anim.gltf.reading.scene_nodes import faces_back
from anim.model import VertexCache
from anim.operations.selection import Selection
from anim.show.filmstrip import clips, filmstrip, image_file
from anim.show.filmstrip.camera import AZIMUTH, ELEVATION
from anim.show.filmstrip.clips import FilmstripClip
from anim.show.filmstrip.filmstrip import HEIGHT, ViewOptions
from anim.show.filmstrip.frame_selection import MAX_FRAMES, FrameSelection
from anim.show.terminal.picture import Protocol
from anim.units import plural
from cli import text
from cli.errors import UsageError
from cli.io import cache_files, documents, scenes
from cli.io.terminal import choose_protocol, print_picture, terminal_size
from cli.options import common, meshes
from cli.options import terminal as pictures
from cli.options.meshes import Method
from cli.progress import announce_compiling

EXTENSIONS = (".png", *image_file.ANIMATED_FORMATS)
FRAMES, FPS = 8, 24.0

MIN_FRAME_COLUMNS = 24  # of half-block characters, to recognize a pose

RenderSource = Annotated[
    str,
    typer.Argument(metavar="IN", help="A glTF file or a vertex cache, '-' for stdin.", show_default=False),
]
Picture = Annotated[
    str,
    typer.Argument(metavar="OUT", help=f"A {', '.join(EXTENSIONS)} file; '-' for stdout (PNG).", show_default=False),
]


def command(
    input: RenderSource = "-",
    output: Picture = "-",
    *,
    at: Annotated[
        list[float] | None, typer.Option("--at", metavar="S", help="Frame at this time in seconds; may be repeated.")
    ] = None,
    count: Annotated[
        int | None,
        typer.Option(
            "--frames", metavar="N", help="Number of frames, evenly spaced; 8 by default.", min=1, max=MAX_FRAMES
        ),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option("--fps", metavar="N", help="Frames per second; 24 by default in an animated image.", min=0.1),
    ] = None,
    begin: common.From = None,
    end: common.To = None,
    clip: common.Clips = None,
    method: Annotated[
        list[Method] | None,
        typer.Option("--method", help="Skinning method; may be repeated to compare.  [default: lbs]"),
    ] = None,
    heat: Annotated[
        bool,
        typer.Option("--heat", help="Color by the distance to the first method; with one method, to the rest pose."),
    ] = False,
    checker: Annotated[
        bool,
        typer.Option("--checker", help="Draw squares fixed to the rest pose, which show twist and stretch."),
    ] = False,
    wire: Annotated[bool, typer.Option("--wire", help="Draw the edges of triangles.")] = False,
    textures: Annotated[
        bool | None,
        typer.Option(
            "--textures/--no-textures",
            help="Draw textures, vertex colors and transparency, or plain colors (default with --heat, "
            "--checker and --wire).",
            show_default=False,
        ),
    ] = None,
    mesh: meshes.Meshes = None,
    hide: meshes.Hidden = None,
    follow: Annotated[
        bool | None,
        typer.Option(
            "--follow/--no-follow",
            help="Move the camera with the figure (default: if it travels farther than its own size).",
            show_default=False,
        ),
    ] = None,
    size: Annotated[
        int, typer.Option("--size", metavar="PX", help="Height of a frame in pixels.", min=32, max=4096)
    ] = HEIGHT,
    azimuth: Annotated[
        float,
        typer.Option(
            "--azimuth", metavar="DEG", help="Camera angle from the figure's front (+Z; in VRM 0.x −Z) toward its left."
        ),
    ] = AZIMUTH,
    elevation: Annotated[
        float, typer.Option("--elevation", metavar="DEG", help="Camera angle above the horizon.", min=-89, max=89)
    ] = ELEVATION,
    terminal: pictures.Terminal = False,
    protocol: pictures.PictureProtocol = None,
    quiet: common.Quiet = False,
) -> None:
    """Draw clips as a filmstrip (.png) or as an animated image (.webp, .gif, .apng).

    Meshes are skinned and flat-shaded, on a ground plane below the feet; the view fits the whole motion. A skeleton
    without a mesh is drawn as sticks. Materials show their base color: factor, texture (PNG, JPEG, WebP) and vertex
    colors; MASK cuts holes, BLEND has nine levels of transparency. The camera follows a figure that travels, and the
    distance is printed beside the time.

    Clips are drawn one below the other, with a row per method; in an animated image, side by side. Without --clip, only
    the first clip is drawn.

    Without OUT the filmstrip is printed in a terminal that shows pictures: kitty, Ghostty and Konsole (protocol kitty);
    iTerm2, WezTerm, mintty and rio (iterm2); foot, mlterm and contour (sixel). In others, and inside tmux, screen and
    Zellij, --terminal prints it in half-block characters, with fewer frames unless chosen. --protocol names one that
    the environment does not tell, such as sixel of xterm and Windows Terminal.
    """
    reporter = text.Reporter(quiet)
    began = time.perf_counter()
    shown = choose_protocol(asked=terminal, protocol=protocol, output=output)
    ending = _ending(output)
    if at and (count is not None or fps is not None):
        raise UsageError("--at excludes --frames and --fps")
    is_moving = ending != ".png"
    rate = fps or (FPS if is_moving and count is None and not at else None)
    when = FrameSelection(tuple(at or ()), count or (None if rate else _default_frames(shown)), rate, begin, end)
    with _opened(input, reporter) as (seen, name, beside, front):
        if isinstance(seen, VertexCache):
            given = {"clip": clip, "method": method, "mesh": mesh, "hide": hide, "textures": textures}
            if unknown := next((name for name, value in given.items() if value), None):
                raise UsageError(f"--{unknown} does not apply to a vertex cache")
            found = clips.of_cache(seen, when)
        else:
            names = reader.names(seen)
            numbers = Selection(clip or ()).chosen_clips(names)[: None if clip else 1]
            if is_moving and count is not None and count > 1 and len(numbers) > 1:
                when = _one_rate(seen, numbers, when)
            announce_compiling(reporter)
            scene = scenes.read_scene(
                seen, name, reporter, nodes=lambda scene: meshes.visible_meshes(scene, mesh, hide)
            )
            nodes = meshes.visible_meshes(scene, mesh, hide)
            scenes.warn_of_other_scenes(seen, name, reporter, nodes)
            found = clips.of_document(
                seen,
                numbers,
                [str(each) for each in method or ()],
                when,
                scene=scene,
                nodes=nodes,
                textures=not (heat or checker or wire) if textures is None else textures,
                resolve=beside,
                note=lambda words: reporter.info(f"note: {name}: {words}"),
            )
        rows, extent = clips.build_strips(found, heated=heat, followed=follow)
        title = " ".join(word for word in (PurePath(name).name, _one_clip(found)) if word)
        look = ViewOptions(size, front + azimuth, elevation, checker, wire)
        if is_moving:
            times = filmstrip.film_times(rows)
            pictures = filmstrip.animate_frames(rows, extent, title=title, look=look)
            drawn = image_file.animation(pictures, ending, fps=fps or when.fps or _rate(times))
        else:
            drawn = image_file.png(filmstrip.filmstrip(rows, extent, title=title, look=look))
    if shown is None:
        documents.write_bytes([np.frombuffer(drawn, np.uint8)], output)
    else:
        print_picture(drawn, shown)
    frames = plural(len(times) if is_moving else sum(len(row.times) for row in rows), "frame")
    called = name if output == documents.PIPE else output
    reporter.info(
        f"{called}  {text.format_bytes(len(drawn))}, {frames}, {text.format_duration(time.perf_counter() - began)}"
    )


def _default_frames(shown: Protocol | None) -> int:
    """Frames without an option; of half blocks, as many as have MIN_FRAME_COLUMNS each."""
    if shown is not Protocol.BLOCKS:
        return FRAMES
    return min(max(terminal_size(os.environ).columns // MIN_FRAME_COLUMNS, 1), FRAMES)


def _ending(output: str) -> str:
    if output == documents.PIPE:
        return ".png"
    documents.check_file(output)
    ending = PurePath(output).suffix.lower()
    if ending not in EXTENSIONS:
        raise UsageError(f"{output}: unsupported image format '{ending}' (expected {', '.join(EXTENSIONS)})")
    return ending


@contextmanager
def _opened(path: str, reporter: text.Reporter) -> Iterator[tuple[Document | VertexCache, str, Resolve | None, float]]:
    """Give a glTF document or a vertex cache, its name, the resolver of its companion files, and its front's azimuth.

    The type follows from the file extension, for a pipe from the first bytes. azimuth: degrees, from +Z.
    reporter: reports the notes of readers.
    """
    if path != documents.PIPE and suffix(path) in CACHE_FORMATS and suffix(path) not in (".glb", ".gltf"):
        with cache_files.load(path, ReadOptions()) as loaded:
            for words in loaded.notes:
                reporter.warn(words)
            yield loaded.cache, loaded.name, None, 0.0
    elif path != documents.PIPE:
        with documents.source(path, reporter) as source:
            beside = None if source.folder is None else resolver.CompanionFiles(source.folder).open
            front = _front(source.document)
            yield flipbook_reader.read_pages(source.document) or source.document, source.name, beside, front
    else:
        with documents.content(path) as (data, name):
            head = data[:SIGNATURE_BYTES].tobytes()
            if head.startswith(b"glTF") or head.lstrip()[:1] == b"{" or not len(data):
                document = container.read(data, resolver.refuse_relative)
                documents.repaired_note(document, name, reporter)
                pages = flipbook_reader.read_pages(document)
                yield pages or document, name, resolver.refuse_relative, _front(document)
            else:
                ending = sniff_format(head, len(data))
                cache_files.check_pipe(name, ending)
                reader = reader_for(ending)
                yield reader(Memory(name, {name: data.tobytes()}), ReadOptions(note=reporter.warn)), name, None, 0.0


def _front(document: Document) -> float:
    """The azimuth of the figures' front, in degrees from +Z."""
    return 180.0 if faces_back(document.json) else 0.0


def _one_rate(document: Document, numbers: Sequence[int], when: FrameSelection) -> FrameSelection:
    """The one frame rate of a film, at which the longest clip has the chosen frame count."""
    clips = reader.clips(document)
    spans = [when.span(clips[i].start, clips[i].end) for i in numbers]
    longest = max(last - first for first, last in spans)
    return replace(when, count=None, fps=((when.count or 0) - 1) / longest) if longest > 0 else when


def _one_clip(found: Sequence[FilmstripClip]) -> str:
    return found[0].name if len({shot.clip for shot in found}) == 1 else ""


def _rate(times: Floats) -> float:
    """Mean frame rate of the times, in frames per second; 1 for a single time."""
    return (len(times) - 1) / float(times[-1] - times[0]) if len(times) > 1 else 1.0
