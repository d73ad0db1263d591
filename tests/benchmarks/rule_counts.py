"""python -m tests.benchmarks.rule_counts [FOLDER]: findings of all rules on real files, beside earlier counts.

The earlier counts are of a study of 29 files, from which the rules were made: 17 of them are in shared/assets, 12 are
not public. Where all files are there, an independent script of that study finds the same files and, but for what the
last column states, the same findings.

Its library of mocap is not here either. On 17 other clips of mocap (the 15 `humanoid3d` motions in the sources of
pybullet 3.2.7, with joints as DeepMimic describes them, and the 2 .bvh files in the sources of bvhtoolbox 0.1.3)
findings are in: GA301 4 clips, GA302 1, GA303 1, GA304 6, GA305 0. The script of the study finds the same clips, but
for GA301, whose rule also asks for a way there and back: 6 clips.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

from anim.check.find import find_all
from anim.check.registry import RULES
from anim.check.selection import RuleSelection
from cli.workflows.checked_files import open_checked
from tests.files import ASSETS

ENDINGS = (".glb", ".gltf", ".vrm", ".vrma")
STUDY: Mapping[str, tuple[str, str]] = {  # counts of 29 files, and why those of the files here differ
    "GA001": ("7 files", "the same files"),
    "GA003": ("not counted", "the same file as that script"),
    "GA004": ("7 files", "the other 2 are not here; the same 89 names"),
    "GA104": ("607 keys in BusterDrone", "a finding has all keys of a clip"),
    "GA106": ("22 clips in 4 files", "the other 3 files are not here; the same 7 clips"),
    "GA114": ("0 (206 without its limits)", "the same"),
    "GA118": ("3 files", "the other 2 are not here"),
    "GA119": ("3 files", "the other 2 are not here"),
    "GA210": ("2 files", "neither is here"),
    "GA211": ("not counted", "that script takes animated nodes of files without skins for joints: InterpolationTest"),
    "GA212": ("12 files", "as for GA211: BusterDrone; a finding has all tracks of a clip, 85 clips for 584 tracks"),
    "GA301": ("116 of 238 clips of mocap", "that library is not here"),
    "GA303": ("24 of 238 clips of mocap", "that library is not here"),
    "GA304": ("28 of 238 clips of mocap, 313 of a stylised character", "Knight and Robot are stylised; opt-in for it"),
}


def main(arguments: Sequence[str]) -> int:
    """Return the exit code; the table goes to stdout."""
    folder = Path(arguments[0]) if arguments else ASSETS
    paths = sorted(path for path in folder.rglob("*") if path.suffix in ENDINGS)
    counts: dict[str, int] = defaultdict(int)
    files: dict[str, set[Path]] = defaultdict(set)
    every = RuleSelection(select=("ALL",))
    for path in paths:
        with open_checked(str(path)) as (_, file):
            for each in find_all(file, every):
                counts[each.code] += 1
                files[each.code].add(path)
    sys.stdout.write(f"{len(paths)} files\n")
    for rule in RULES:
        before, why = STUDY.get(rule.code, ("", ""))
        here = f"{counts[rule.code]} in {len(files[rule.code])} files"
        sys.stdout.write(f"{rule.code}  {rule.name:28}  {here:18}  {before:50}  {why}".rstrip() + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
