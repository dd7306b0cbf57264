# SPDX-License-Identifier: Apache-2.0
"""Checks of the caller's arguments. Their messages have the caller's own names, and the units."""

from __future__ import annotations

import contextlib
import difflib
import operator
from collections.abc import Collection, Iterable, Mapping
from typing import Any, NoReturn, Optional

import numpy

MOST_OF_32_BITS = 2**32 - 1
GAIN = "a number. A gain is a linear factor: 1 keeps the level, and 10 ** (x / 20) changes it by x decibels"


def counted(count: int, noun: str) -> str:
    """Returns a number with its noun: "1 contact", "2 contacts"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def suggestion(name: str, known: Collection[str]) -> str:
    """Returns 'did you mean "NEAREST"?', or nothing if no known name is near."""
    nearest = difflib.get_close_matches(name, known, 1)
    return f'did you mean "{nearest[0]}"?' if nearest else ""


def refuse_unknown(given: Iterable[str], known: Collection[str], where: str) -> None:
    """Raises TypeError with the nearest known name if a given name is unknown."""
    for name in given:
        if name not in known:
            hint = suggestion(name, known) or f"it has {', '.join(sorted(known))}"
            raise TypeError(f'{where} has no "{name}"; {hint}')


def message(kind: Any, where: str, given: Mapping[str, Any], more: Collection[str] = ()) -> Any:
    """Makes a message of arguments that have the names of its fields. Raises TypeError that names the argument which
    is unknown or of the wrong type. The caller may know `more` arguments."""
    fields = kind.DESCRIPTOR.fields_by_name
    _refuse_unknown_fields(kind.DESCRIPTOR, where, given, more)
    try:
        return kind(**given)
    except (TypeError, ValueError) as error:
        for name, value in given.items():
            _refuse_wrong(kind, fields[name], where, value, error)
        raise


def _places(descriptor: Any, name: str) -> list[str]:
    """How a caller gives a field of the messages within a message, such as "settings=dict(poisson_ratio=...)"."""
    found = []
    for field in descriptor.fields:
        if field.message_type is not None and field.label != field.LABEL_REPEATED:
            call = "carillon.material" if field.message_type.name == "Material" else "dict"
            known = field.message_type.fields_by_name.get(name)
            inner = [] if known is None else [f"{name}={'True' if known.cpp_type == known.CPPTYPE_BOOL else '...'}"]
            found += [f"{field.name}={call}({place})" for place in inner + _places(field.message_type, name)]
    return found


def _refuse_unknown_fields(descriptor: Any, where: str, given: Mapping[str, Any], more: Collection[str] = ()) -> None:
    """Raises TypeError for an unknown name in the arguments, or in a dictionary that stands for a message."""
    known = [*descriptor.fields_by_name, *more]
    for name in given:
        places = [] if name in known else _places(descriptor, name)
        if places:
            raise TypeError(f'{where} has no "{name}"; give it as {" or ".join(places)}')
    refuse_unknown(given, known, where)
    for name, value in given.items():
        inner = descriptor.fields_by_name[name].message_type
        if isinstance(value, Mapping) and inner is not None and not inner.GetOptions().map_entry:
            _refuse_unknown_fields(inner, name, value)


def _refuse_wrong(kind: Any, field: Any, where: str, value: Any, cause: Exception) -> None:
    """Raises TypeError if a field cannot have the value."""
    try:
        kind(**{field.name: value})
    except (TypeError, ValueError):
        wanted = "a number" if field.name != "gain" else GAIN
        if field.enum_type is not None:
            wanted = "one of " + ", ".join(field.enum_type.values_by_name)
        elif field.message_type is not None:
            wanted = f"a {field.message_type.name} of the contract, or a dictionary"
        elif field.cpp_type == field.CPPTYPE_STRING:
            wanted = "text"
        elif field.cpp_type == field.CPPTYPE_BOOL:
            wanted = "True or False"
        elif field.cpp_type == field.CPPTYPE_UINT32 or field.cpp_type == field.CPPTYPE_UINT64:
            wanted = "a whole number, zero or more"
        raise TypeError(f"{field.name} of {where} is {value!r}; it must be {wanted}") from cause


def choice(enum: Any, prefix: str, name: str, given: Optional[str]) -> Any:
    """Returns the value of the contract for a word of the caller, and the unspecified one for None."""
    words = {label.removeprefix(prefix).lower(): value for label, value in enum.items()}
    unspecified = words.pop("unspecified")
    if given is None:
        return unspecified
    if not isinstance(given, str) or given.lower() not in words:
        raise ValueError(f"{name} is {given!r}; it must be one of " + ", ".join(f'"{word}"' for word in words))
    return words[given.lower()]


def expect(given: Any, kind: type, name: str) -> None:
    """Raises TypeError if an argument is not of the class of this package."""
    if not isinstance(given, kind):
        raise TypeError(f"{name} is of type {type(given).__name__}; it must be a carillon.{kind.__name__}")


def number(value: Any, name: str, meaning: str) -> float:
    """Converts to a number, and no text. Raises ValueError that says what the number means if that is impossible."""
    if not isinstance(value, (str, bytes)):
        with contextlib.suppress(TypeError, ValueError):
            return float(value)
    refuse(value, name, meaning)


def numbers(values: Any, name: str, meaning: str) -> numpy.ndarray:
    """Converts to an array. Raises ValueError that says what the numbers mean if that is impossible."""
    try:
        array = numpy.asarray(values)
        if array.dtype.kind != "c":
            return array.astype(float, copy=False)
    except (TypeError, ValueError):
        refuse(values, name, meaning)
    refuse(values, name, f"real and not complex: {meaning}")


def three(values: Any, name: str, meaning: str) -> numpy.ndarray:
    """Converts to x, y, z. Raises ValueError if there are not three numbers."""
    array = numbers(values, name, f"x, y, z, {meaning}")
    if array.size != 3:
        refuse(values, name, f"three numbers: x, y, z, {meaning}")
    return array.reshape(3)


def integer(value: Any, name: str, wanted: str) -> int:
    """Converts to an integer. Raises TypeError that shows what is none."""
    try:
        return operator.index(value)
    except TypeError:
        refuse(value, name, wanted, TypeError)


def index(value: Any, name: str, wanted: str) -> int:
    """Converts to an integer of 32 bits. Raises ValueError that shows one that is negative or too large."""
    number = integer(value, name, wanted)
    if not 0 <= number <= MOST_OF_32_BITS:
        refuse(value, name, wanted)
    return number


def whole_numbers(values: numpy.ndarray, name: str, wanted: str) -> numpy.ndarray:
    """Converts to 32 bits. Raises ValueError that shows the first number that is not whole, negative or too large."""
    if values.dtype.kind in "iu" and (not values.size or (values.min() >= 0 and values.max() <= MOST_OF_32_BITS)):
        return values.astype(numpy.uint32)
    with numpy.errstate(invalid="ignore"):  # of infinite and undefined numbers, which are refused
        is_right = (values >= 0) & (values <= MOST_OF_32_BITS) & (values % 1 == 0)
    if not is_right.all():
        refuse(values[~is_right].tolist()[0], f"an entry of {name}", wanted)
    return values.astype(numpy.uint32)


def refuse(given: Any, name: str, wanted: str, kind: type[Exception] = ValueError) -> NoReturn:
    """Raises an error that shows the value, cut if it is long."""
    shown = " ".join(repr(given).split())
    raise kind(f"{name} is {shown if len(shown) <= 80 else shown[:77] + '...'}; it must be {wanted}")
