# SPDX-License-Identifier: BSD-3-Clause
"""Says in one line why the arguments of a call do not fit."""

import operator
import re
from collections import abc

from . import _dyop

# "    1. (a: dyop._dyop.Shape, t: float = 0.0) -> float", "    1. dyop._dyop.Sphere(radius: float)"
_FORM = re.compile(r"^ {4}\d+\. (?:([\w.]+))?\((.*)\)(?: -> .*)?$")
_PARAMETER = re.compile(r"(\w+): (.*?)(?: = (.*))?$", re.S)


# Strings are no numbers to pybind11.
_NUMBERS = {
    "float": lambda value: None if isinstance(value, (str, bytes)) else float(value),
    "int": operator.index,
    "bool": bool,
}
# What a converter says of a value without knowing which argument it is.
_UNNAMED = re.compile(
    r"(vector|matrix|pose|position of a pose|twist|v|w|state|interval) must be .*, not (.*)$", re.S
)
_CONVERTED = re.compile(r"PoseLike|TwistLike|StateLike|IntervalLike|object|handle|numpy\.ndarray\[\(3,")


def _split(text):
    """Splits at commas outside of brackets and quotes."""
    parts, depth, quote, start = [], 0, None, 0
    for i, c in enumerate(text):
        if quote is not None:
            quote = None if c == quote else quote
        elif c in "'\"":
            quote = c
        elif c == "," and depth == 0:
            parts.append(text[start:i])
            start = i + 1
        else:
            depth += (c in "([{<") - (c in ")]}>")
    return [part.strip() for part in [*parts, text[start:]] if part.strip()]


def _inside(kind):
    return _split(kind[kind.index("[") + 1 : -1])


def _is_sequence(value):
    return isinstance(value, abc.Iterable) and not isinstance(value, (str, bytes, abc.Mapping))


def _fits(kind, value):
    """Whether a value is of a type as pybind11 writes it; True if that cannot be told."""
    if kind.startswith("Optional["):
        return value is None or _fits(_inside(kind)[0], value)
    if kind.startswith("Union["):
        return any(_fits(one, value) for one in _inside(kind))
    if kind.startswith("List["):
        return _is_sequence(value) and all(_fits(_inside(kind)[0], item) for item in value)
    if kind.startswith("Tuple["):
        kinds = _inside(kind)
        return (
            _is_sequence(value)
            and len(value) == len(kinds)
            and all(_fits(*pair) for pair in zip(kinds, value))
        )
    if kind in _NUMBERS:
        # Arrays have all these methods, and most refuse to be called.
        try:
            return _NUMBERS[kind](value) is not None
        except (TypeError, ValueError, OverflowError):
            return False
    if kind == "str":
        return isinstance(value, (str, bytes))
    if kind == "Iterable":
        return isinstance(value, abc.Iterable)
    known = getattr(_dyop, kind.split(".")[-1], None)
    return not isinstance(known, type) or isinstance(value, known)


def _wanted(kind):
    return {"float": "a number", "int": "an integer", "str": "a string"}.get(
        kind, kind.replace("dyop._dyop.", "")
    )


def _problem(parameters, args, kwargs):
    """How many arguments fit before the first that does not, and what is wrong with that one.

    None for what is wrong if all seem to fit.
    """
    given = dict(kwargs)
    fitting = 0
    names = []
    values = list(args)
    takes_more = False
    is_keyword = False
    for parameter in parameters:
        if parameter.startswith("*"):
            takes_more = takes_more or parameter != "*"
            is_keyword = True
            continue
        name, kind, default = _PARAMETER.match(parameter).groups()
        names.append(name)
        if values and not is_keyword:
            value = values.pop(0)
            if name in given:
                return fitting, f"argument '{name}' is given twice"
        elif name in given:
            value = given.pop(name)
        elif default is None:
            return fitting, f"argument '{name}' is missing"
        else:
            continue
        if value is None and default == "None":
            fitting += 1
            continue
        if not _fits(kind, value):
            wanted = f"must be {_wanted(kind)}, not a value of type {type(value).__name__}"
            return fitting, f"argument '{name}' {wanted}"
        if kind == "int" and not 0 <= operator.index(value) < 2**31:
            return fitting, f"argument '{name}' is out of range: {value}"
        fitting += 1
    if takes_more:
        return fitting, None
    if values:
        return fitting, f"{len(args)} arguments are given without a name, which is too many"
    for name in given:
        return fitting, f"there is no argument '{name}'; there are {', '.join(names)}"
    return fitting, None


def _of_all(name):
    """What to say of a call whose arguments seem to fit: a record takes fields by name alone."""
    fields = getattr(getattr(_dyop, name, None), "_fields", ())
    return f"its fields are given by name: {', '.join(fields)}" if fields else "the arguments do not fit"


def explain(message, args, kwargs):
    """One line for what pybind11 says of a refused call."""
    name = message.partition("(")[0]
    problems = []
    for line in message.splitlines():
        form = _FORM.match(line)
        if form is None:
            continue
        parameters = _split(form[2])
        values = args
        if form[1]:  # a constructor: its object comes first, and is not listed
            name, values = form[1].split(".")[-1], args[1:]
        elif parameters and parameters[0].startswith("self:"):
            parameters, values = parameters[1:], args[1:]
        fitting, problem = _problem(parameters, values, kwargs)
        problems.append((fitting, problem or _of_all(name)))
    if not problems:
        return message
    # The form of the call that was meant is the one of which most fits.
    most = max(fitting for fitting, _ in problems)
    nearest = dict.fromkeys(problem for fitting, problem in problems if fitting == most)
    return f"{name or 'this attribute'}(): " + "; or: ".join(nearest)


def _describes(text, value):
    """Whether text is what a converter says of the value, or of a part of it."""
    if hasattr(value, "dtype") and hasattr(value, "shape"):
        return text == f"an array of {value.dtype} and shape {value.shape}"
    if text == f"a value of type {type(value).__name__}":
        return True
    return isinstance(value, (tuple, list)) and any(_describes(text, part) for part in value)


def name_argument(message, signatures, args, kwargs):
    """Puts the name of an argument before what a converter says of its value."""
    found = _UNNAMED.match(message)
    if found is None:
        return message
    for signature in signatures:
        parameters = _split(signature[1 : signature.rindex(") -> ")])
        is_method = bool(parameters) and parameters[0].startswith("self:")
        given = list(args)
        for parameter in parameters:
            form = _PARAMETER.match(parameter)
            if form is None:  # "*", after which names are needed
                given = []
                continue
            name = form[1]
            value = given.pop(0) if given else kwargs.get(name)
            if is_method and name == "self" or not _CONVERTED.search(form[2]):
                continue
            if name != found[1] and _describes(found[2], value):
                return f"{name}: {message}"
    return message
