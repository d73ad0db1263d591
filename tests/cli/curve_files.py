"""Small files of curves for `from-euler`."""

from __future__ import annotations

from tests import khronos

SMALL = b"""HIERARCHY
ROOT hip
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT knee
  {
    OFFSET 0 -85 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -85 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.033333
0 90 0 0 0 0 0 0 0
1 90 0 0 0 90 0 90 0
"""


CURVES = b"time,door.rx,door.ry,door.rz\n0,0,0,0\n1,90,90,0\n"
XYZ = ("--order", "XYZ", "--axes", "intrinsic", "--unit", "deg")


def valid(data: bytes) -> None:
    if not khronos.missing():
        report = khronos.validate(data)
        assert khronos.errors(report) == []
        assert report["issues"]["numWarnings"] == 0
