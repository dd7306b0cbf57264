# SPDX-License-Identifier: Apache-2.0
"""Tells which alert rules fire at given values of the daemon's metrics.

Debian has promtool only in the package prometheus, which has 96 MB and starts a server. This module evaluates the part
of PromQL that the rules use, and refuses the rest. A counter is stated by its rise a second, so that `rate` and
`increase` need no samples of several times. The time that a rule waits (`for`) is ignored.
"""

import math
import operator
import re

import yaml

TOKEN = re.compile(r'\s*(?:(?P<number>\d+(?:\.\d+)?)(?![\d.smhd])|(?P<range>\[\d+[smhd]\])|(?P<text>"[^"]*")'
                   r'|(?P<name>[a-zA-Z_]\w*)|(?P<sign>=~|!~|==|!=|>=|<=|[-+*/<>=(){},]))')
SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86400}
ARITHMETIC = {"+": operator.add, "-": operator.sub, "*": operator.mul,
              "/": lambda a, b: a / b if b else math.nan}
COMPARISONS = {"==": operator.eq, "!=": operator.ne, ">": operator.gt, "<": operator.lt, ">=": operator.ge,
               "<=": operator.le}
SETS = ("and", "unless", "or")
# From the weakest to the strongest; the operators of a row are grouped from the left.
PRECEDENCE = (("or",), ("and", "unless"), tuple(COMPARISONS), ("+", "-"), ("*", "/"))


def rules(file):
    """The alerts of a file of rules, with their expressions."""
    groups = yaml.safe_load(file.read_text())["groups"]
    return {rule["alert"]: rule["expr"] for group in groups for rule in group["rules"]}


def values_of(stated):
    """Values by selector, such as {'a_total{b="c"}': 1}, as a map from names and labels to values."""
    values = {}
    for selector, value in stated.items():
        name, matchers = Expression(selector, {}).selector()
        values.setdefault(name, {})[frozenset((label, text) for label, _, text in matchers)] = value
    return values


def fires(expression, values):
    """Whether an alert with that expression fires at those values (see values_of)."""
    result = Expression(expression, values).evaluate()
    if not isinstance(result, dict):
        raise ValueError(f"an alert needs a vector: {expression}")
    return bool(result)


def matched_labels(labels, matching):
    """The labels by which both sides of an operator are compared."""
    kind, names = matching
    return frozenset(pair for pair in labels if (pair[0] in names) == (kind == "on"))


def by_matched_labels(vector, matching):
    """Values by the labels that are compared. Prometheus refuses two values with the same ones, and so does this."""
    result = {matched_labels(labels, matching): value for labels, value in vector.items()}
    if len(result) < len(vector):
        raise ValueError(f"several values of one side have the same labels: {sorted(map(sorted, vector))}")
    return result


def combine(sign, left, right, matching):
    """`left sign right`. A vector maps sets of labels to values; a scalar is a number."""
    if sign in SETS:
        known = {matched_labels(labels, matching) for labels in right}
        if sign == "or":
            had = {matched_labels(labels, matching) for labels in left}
            return left | {labels: value for labels, value in right.items()
                           if matched_labels(labels, matching) not in had}
        return {labels: value for labels, value in left.items()
                if (matched_labels(labels, matching) in known) == (sign == "and")}
    if isinstance(left, dict) and isinstance(right, dict):
        left, right = by_matched_labels(left, matching), by_matched_labels(right, matching)
        pairs = {labels: (value, right[labels]) for labels, value in left.items() if labels in right}
    elif isinstance(left, dict):
        pairs = {labels: (value, right) for labels, value in left.items()}
    elif isinstance(right, dict):
        pairs = {labels: (left, value) for labels, value in right.items()}
    else:
        return ARITHMETIC[sign](left, right)
    if sign in ARITHMETIC:
        return {labels: ARITHMETIC[sign](*pair) for labels, pair in pairs.items()}
    kept = 0 if isinstance(left, dict) else 1
    return {labels: pair[kept] for labels, pair in pairs.items() if COMPARISONS[sign](*pair)}


class Expression:
    """Reads an expression of PromQL from its beginning, and evaluates what it reads."""

    def __init__(self, text, values):
        self._values = values
        self._tokens = []
        place = 0
        while place < len(text.rstrip()):
            match = TOKEN.match(text, place)
            if not match:
                raise ValueError(f"not understood: {text[place:]}")
            self._tokens.append((match.lastgroup, match[match.lastgroup]))
            place = match.end()
        self._tokens.append(("end", ""))

    def evaluate(self):
        """The value of the whole text."""
        value = self._operators(0)
        self._expect("")
        return value

    def selector(self):
        """The name of a metric, and its matchers: triples of label, sign and text."""
        name = self._next()
        matchers = []
        if self._take("{"):
            while not self._take("}"):
                label, sign, text = self._next(), self._next(), self._next()
                matchers.append((label, sign, text.strip('"')))
                self._take(",")
        return name, matchers

    def _next(self):
        return self._tokens.pop(0)[1]

    def _take(self, text):
        if self._tokens[0][1] != text:
            return False
        self._tokens.pop(0)
        return True

    def _expect(self, text):
        if self._tokens[0][1] != text:
            raise ValueError(f"{self._tokens[0][1]!r} instead of {text!r}")
        self._tokens.pop(0)

    def _operators(self, level):
        if level == len(PRECEDENCE):
            return self._operand()
        left = self._operators(level + 1)
        while self._tokens[0][1] in PRECEDENCE[level]:
            sign = self._next()
            matching = self._matching()
            left = combine(sign, left, self._operators(level + 1), matching)
        return left

    def _matching(self):
        if self._tokens[0][1] not in ("on", "ignoring"):
            return "ignoring", ()
        kind = self._next()
        self._expect("(")
        names = []
        while not self._take(")"):
            names.append(self._next())
            self._take(",")
        return kind, names

    def _operand(self):
        kind, text = self._tokens[0]
        if kind == "number":
            return float(self._next())
        if self._take("("):
            value = self._operators(0)
            self._expect(")")
            return value
        if text in ("rate", "increase"):
            return self._rise()
        if kind != "name":
            raise ValueError(f"{text!r} is no operand")
        name, matchers = self.selector()
        if name.endswith("_total"):
            raise ValueError(f"{name} only rises: an alert needs its rate or increase")
        return self._select(name, matchers)

    def _rise(self):
        function = self._next()
        self._expect("(")
        name, matchers = self.selector()
        if not name.endswith("_total"):
            raise ValueError(f"{function} of {name}, which is no counter")
        length = self._next()
        self._expect(")")
        seconds = int(length[1:-2]) * SECONDS[length[-2]]
        factor = 1 if function == "rate" else seconds
        return {labels: factor * value for labels, value in self._select(name, matchers).items()}

    def _select(self, name, matchers):
        return {labels: value for labels, value in self._values.get(name, {}).items()
                if all(self._matches(dict(labels).get(label, ""), sign, text) for label, sign, text in matchers)}

    @staticmethod
    def _matches(value, sign, text):
        if sign in ("=~", "!~"):
            return bool(re.fullmatch(text, value)) == (sign == "=~")
        return (value == text) == (sign == "=")
