"""Selection of rules, by code, prefix of a code, or name; their parameters and severities."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from anim.check.finding import Severity
from anim.check.registry import RULES
from anim.check.rule import Parameter, Parameters, Rule, TextParameter
from anim.errors import NotFoundError, RangeError

TARGETS = tuple(sorted({target for rule in RULES for target in rule.targets}))
_FACTORS = {"deg": {"deg": 1.0, "°": 1.0, "rad": 57.29577951308232}, "%": {"%": 0.01, "": 1.0}}
_FACTORS |= {"s": {"s": 1.0, "ms": 1e-3}, "fps": {"fps": 1.0}, "x": {"x": 1.0}, "": {}}


@dataclass(frozen=True)
class RuleSelection:
    """Rules to apply. select: those, instead of the default ones ("ALL": all); extend: those too; ignore: not those.

    Each is a code, the beginning of one ("GA1"), or a name. target: the player whose severities count.
    parameters: values by "GA301.angle".
    """

    select: Sequence[str] = ()
    extend: Sequence[str] = ()
    ignore: Sequence[str] = ()
    target: str = ""
    parameters: Mapping[str, str] = field(default_factory=dict)

    def check(self) -> None:
        """Raise NotFoundError or RangeError for an unknown rule, target or parameter, or a wrong value."""
        if self.target and self.target not in TARGETS:
            raise NotFoundError(f"there is no target '{self.target}'", help=f"targets: {', '.join(TARGETS)}")
        self.rules()
        for key, text in self.parameters.items():
            rule, name = parameter_of(key)
            if name in rule.texts:
                parse_pattern(text, key, rule.texts[name])
            else:
                parse_parameter(text, key, rule.parameters[name])

    def rules(self) -> list[Rule]:
        """Return the selected rules in the table's order."""
        default = [rule for rule in RULES if rule.is_default or self.target in rule.targets]
        chosen = set(matching(self.select)) if self.select else {rule.code for rule in default}
        chosen |= set(matching(self.extend))
        chosen -= set(matching(self.ignore))
        return [rule for rule in RULES if rule.code in chosen]

    def severity(self, rule: Rule) -> Severity:
        """Return the severity of a rule's findings for the target."""
        return rule.targets.get(self.target, rule.severity)

    def values(self, rule: Rule) -> Parameters:
        """Return the parameters of a rule."""
        values = rule.defaults(self.target)
        texts = dict(values.texts)
        for key, text in self.parameters.items():
            owner, name = parameter_of(key)
            if owner is rule and name in rule.texts:
                texts[name] = parse_pattern(text, key, rule.texts[name])
            elif owner is rule:
                values[name] = parse_parameter(text, key, rule.parameters[name])
        return Parameters(values, texts, self.target)


def matching(words: Iterable[str]) -> Iterator[str]:
    """Yield the codes of the rules that words name. Raises NotFoundError with the nearest name."""
    for word in words:
        found = [rule.code for rule in RULES if word in ("ALL", rule.name) or rule.code.startswith(word.upper())]
        if not found or not word:
            raise _unknown(word)
        yield from found


def rule_of(word: str) -> Rule:
    """Return a rule by its code or name. Raises NotFoundError with the nearest one."""
    for rule in RULES:
        if word.upper() == rule.code or word == rule.name:
            return rule
    raise _unknown(word)


def parameter_of(key: str) -> tuple[Rule, str]:
    """Return the rule and the parameter's name of "GA301.angle". Raises NotFoundError."""
    word, _, name = key.partition(".")
    rule = rule_of(word)
    if name not in rule.parameters and name not in rule.texts:
        names = ", ".join(f"{rule.code}.{each}" for each in (*rule.parameters, *rule.texts)) or "none"
        raise NotFoundError(f"there is no parameter '{key}'", help=f"parameters of {rule.code} {rule.name}: {names}")
    return rule, name


def parse_parameter(text: str, key: str, parameter: Parameter) -> float:
    """Return the value of "8deg", "5%" or "0.2s"; a number alone has the parameter's unit (fractions for %)."""
    number = text.strip()
    for suffix, factor in sorted(_FACTORS[parameter.unit].items(), key=lambda each: -len(each[0])):
        if suffix and number.endswith(suffix):
            return _number(number.removesuffix(suffix), text, key, parameter) * factor
    return _number(number, text, key, parameter)


def parse_pattern(text: str, key: str, parameter: TextParameter) -> str:
    """Return a regular expression. Raises RangeError if it is none."""
    try:
        re.compile(text)
    except re.error as error:
        raise RangeError(
            f"parameter {key} is '{text}': {error} (expected a pattern like {parameter.example})"
        ) from None
    return text


def _number(number: str, text: str, key: str, parameter: Parameter) -> float:
    try:
        value = float(number)
    except ValueError:
        value = -1.0
    if not 0 <= value < float("inf"):
        example = f"{parameter.default:g}{parameter.unit}" if parameter.unit != "%" else f"{parameter.default:.3g}"
        raise RangeError(f"parameter {key} is '{text}' (expected a number like {example})")
    return value


def _unknown(word: str) -> NotFoundError:
    near = difflib.get_close_matches(word.lower(), [rule.name for rule in RULES], n=1)
    return NotFoundError(
        f"there is no rule '{word}'", help=f"did you mean {near[0]}?" if near else "gltf-anim check --list shows them"
    )
