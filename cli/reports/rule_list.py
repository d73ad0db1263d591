"""Texts of `check --list` and `check --explain`."""

from __future__ import annotations

from textwrap import fill

from anim.check.registry import RULES
from anim.check.rule import Rule
from cli import tables

WIDTH = 100  # characters per line of an explanation


def rule_table() -> str:
    """Return a line per rule, by code."""
    rows: list[list[tables.Cell]] = [
        [rule.code, rule.name, rule.severity.value if rule.is_default else "off", _fix(rule), rule.about]
        for rule in sorted(RULES, key=lambda rule: rule.code)
    ]
    return tables.text(["rule", "name", "severity", "fix", "finds"], rows, left=5, indent="")


def _fix(rule: Rule) -> str:
    return "" if rule.fix is None else "safe" if rule.fix.is_safe else "unsafe"


def explain(rule: Rule) -> str:
    """Return reason, targets, advice, fix and parameters of a rule."""
    level = rule.severity.value if rule.is_default else f"{rule.severity.value}, off by default (--extend-select)"
    lines = [f"{rule.code} {rule.name}  [{level}]", "", rule.about, "", fill(rule.why, WIDTH)]
    lines += [f"With --target {target}: {severity}." for target, severity in rule.targets.items()]
    if rule.advice:
        advice = rule.advice.format(fps="FPS", finer="FPS", blend=" --blend S", clips="")
        lines += ["", fill(f"Advice: {advice}", WIDTH)]
    if rule.fix is not None:
        lines += ["", f"Fix ({_fix(rule)}): {rule.fix.about}"]
    for name, each in rule.parameters.items():
        unit = "" if each.unit == "%" else each.unit
        lines += ["", f"--param {rule.code}.{name}={each.default:g}{unit}  {each.about}"]
    for name, pattern in rule.texts.items():
        lines += ["", f"--param '{rule.code}.{name}={pattern.example}'  {pattern.about}"]
    return "\n".join(lines) + "\n"
