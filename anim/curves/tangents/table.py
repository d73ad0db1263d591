"""Table of tangent rules, and their application to keys."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from anim import arrays
from anim.arrays import Floats
from anim.curves.easing.expression import Factory, numbers, parse_call
from anim.curves.tangents import c2 as smooth
from anim.curves.tangents import local
from anim.curves.tangents.rule import SplineKeys, TangentRule, local_rule
from anim.errors import RangeError, ShapeError
from anim.maths import quaternion as quat

LOOP_TOLERANCE_RAD = 1e-3  # rad between first and last key of a closed loop

TANGENTS: dict[str, TangentRule] = {
    rule.name: rule
    for rule in (
        local_rule("time-aware", local.bessel),
        local_rule("catmull-rom", local.catmull_rom),
        local_rule("centripetal", local.centripetal, by_path=True),
        local_rule("monotone", local.monotone),
        local_rule("akima", local.akima, by_path=True),
        local_rule("flat", local.flat),
        TangentRule("natural", smooth.natural, smooth.periodic, smooth=True),
        TangentRule("clamped", smooth.clamped, smooth.clamped, smooth=True),
        TangentRule("periodic", smooth.periodic, smooth.periodic, smooth=True, loop=True),
        TangentRule("bspline", smooth.bspline, smooth.cyclic_bspline, smooth=True),
    )
}

TANGENT_FACTORIES: dict[str, Factory[TangentRule]] = {
    "cardinal": Factory("cardinal(tension)", lambda args: local.cardinal(*numbers(args, 1))),
    "tcb": Factory("tcb(tension, continuity, bias)", lambda args: local.tcb(*numbers(args, 3))),
}

DEFAULT_RULE = "time-aware"


def parse(text: str) -> TangentRule:
    """Return the rule named by a text: one of TANGENTS, or one of TANGENT_FACTORIES with its arguments.

    Raises RangeError for an unknown name, with the nearest ones in its help, and for invalid arguments.
    parse("tcb(0, 0, 0.5)"), parse("akima")
    """
    return parse_call(text, TANGENTS, TANGENT_FACTORIES, kind="tangent rule", listing="TANGENTS")


def apply_tangents(times: ArrayLike, values: ArrayLike, rule: TangentRule, *, cyclic: bool = False) -> SplineKeys:
    """Return CUBICSPLINE keys for times (K,) s: values (K, C) and the rule's tangents per second.

    values: (K, C), or those of G tracks (K, G, C) for a rule that is neither smooth nor by path.
    cyclic: the last key is the first one of the next cycle, so speed is continuous there (for C2 rules acceleration
    too: natural becomes periodic). The difference of last and first value is the displacement per cycle.
    The unused tangents, before the first and after the last key, are 0; so are all of a single key.
    Raises RangeError or ShapeError for arrays that are not valid keys.
    keys 0, 1, 2 s with 0, 1, 0 by time-aware → out-tangents 2, 0, (0), in-tangents (0), 0, −2
    """
    t, v = _check_keys(times, arrays.as_floats(values, _shape(values, "C"), name="values"))
    return _clear_end_tangents(_keys(t, v, rule, cyclic))


def apply_rotation_tangents(
    times: ArrayLike, rotations: ArrayLike, rule: TangentRule, *, cyclic: bool = False
) -> SplineKeys:
    """Return CUBICSPLINE keys for times (K,) s: quaternions (K, 4), signs aligned, and their tangents.

    Local rules work on the rotations from key to key, unrolled into a curve of rotation vectors in body axes: its
    slopes are angular velocities ω, and the tangents ½ q ⊗ ω. C2 rules work on the components, which stay C2 when the
    player normalizes them; through bspline's values, which are normalized here, a second C2 curve is solved. Best below
    120° between keys. rotations: or those of G tracks (K, G, 4), as in apply_tangents.
    cyclic: as in apply_tangents; for C2 rules the last key must be the first one, or its negative.
    Raises RangeError for an open loop under a C2 rule, or a quaternion of length 0.
    """
    t, checked = _check_keys(times, arrays.as_floats(rotations, _shape(rotations, "4"), name="rotations"))
    q = quat.align_signs(quat.normalize(checked))
    if rule.smooth:
        return _clear_end_tangents(_component_keys(t, q, rule, rule.loop or (cyclic and rule.cyclic is not rule.open)))
    turns = quat.rotation_vector(quat.multiply(quat.conjugate(q[:-1]), q[1:]))
    rolled_out = np.concatenate((np.zeros((1, *turns.shape[1:])), np.cumsum(turns, axis=0)))
    rates = _keys(t, rolled_out, rule, cyclic)
    return _clear_end_tangents(
        SplineKeys(q, quat.derivative(q, rates.in_tangents), quat.derivative(q, rates.out_tangents), rates.departure)
    )


def check_closed(rotations: Floats) -> None:
    """Raise RangeError if unit quaternions (K, 4) of a loop start and end in different rotations."""
    turn = float(quat.angle_between(rotations[0], rotations[-1]))
    if turn > LOOP_TOLERANCE_RAD:
        raise RangeError(
            f"the loop is open: its last key is {np.degrees(turn):.3g}° from its first (expected the same rotation)"
        )


def _shape(values: ArrayLike, components: str) -> str:
    return f"K G {components}" if np.ndim(values) == 3 else f"K {components}"


def _check_keys(times: ArrayLike, values: Floats) -> tuple[Floats, Floats]:
    t = arrays.as_key_times(times)
    if len(t) != len(values):
        raise ShapeError(f"{len(values)} values for {len(t)} times (expected as many)")
    return t, values


def _keys(times: Floats, values: Floats, rule: TangentRule, cyclic: bool) -> SplineKeys:
    if len(times) == 1:
        return SplineKeys(values, np.zeros_like(values), np.zeros_like(values))
    keys = (rule.cyclic if cyclic else rule.open)(times, values.reshape(len(values), -1))
    shape = values.shape
    before, after = keys.in_tangents.reshape(shape), keys.out_tangents.reshape(shape)
    return SplineKeys(keys.values.reshape(shape), before, after, keys.departure)


def _component_keys(times: Floats, q: Floats, rule: TangentRule, cyclic: bool) -> SplineKeys:
    """Return the rule's keys of quaternion components; a loop that ends at −q is closed by two cycles."""
    if cyclic:
        check_closed(q)
    count = len(q)
    if cyclic and quat.dot(q[0], q[-1]) < 0:
        times, q = np.concatenate((times, times[1:] + times[-1] - times[0])), np.concatenate((q, -q[1:]))
    keys = _keys(times, q, rule, cyclic)
    if keys.departure == 0:
        return SplineKeys(q[:count], keys.in_tangents[:count], keys.out_tangents[:count])
    length = np.sqrt(quat.dot(keys.values, keys.values))[:, None]
    unit = keys.values / length
    if cyclic:
        through = smooth.periodic(times, unit)
    else:
        ends = keys.out_tangents[[0, -1]] / length[[0, -1]]
        through = smooth.with_end_slopes(times, unit, *ends)
    angle = float(quat.angle_between(unit[:count], q[:count]).max())
    return SplineKeys(unit[:count], through.in_tangents[:count], through.out_tangents[:count], angle)


def _clear_end_tangents(keys: SplineKeys) -> SplineKeys:
    """Return the keys with the unused tangents, before the first and after the last key, set to 0."""
    before, after = keys.in_tangents.copy(), keys.out_tangents.copy()
    before[0], after[-1] = 0.0, 0.0
    return SplineKeys(keys.values, before, after, keys.departure)
