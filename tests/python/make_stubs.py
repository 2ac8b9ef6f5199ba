# SPDX-License-Identifier: BSD-3-Clause
"""Writes the type stubs of the module dyop._dyop from what it says of itself.

Usage, with the built package on PYTHONPATH: make_stubs.py FILE
Types come from the signatures that pybind11 puts into docstrings, and from the first word of the
docstrings of properties ("float: length"). A test compares FILE with what this would write.
"""

import re
import sys

import dyop._dyop as module

HEAD = '''\
# SPDX-License-Identifier: BSD-3-Clause
# Written by tests/python/make_stubs.py.
from typing import (
    Any, Callable, ClassVar, Dict, Generic, Iterable, Iterator, List, Optional, Protocol, Sequence,
    Tuple, Type, TypeVar, Union, overload,
)

import os

import numpy
from numpy.typing import ArrayLike, NDArray

_T = TypeVar("_T")
_Get = TypeVar("_Get", covariant=True)
_Set = TypeVar("_Set", contravariant=True)

class _Field(Generic[_Get, _Set]):
    """A field that accepts more than it gives."""
    @overload
    def __get__(self, instance: None, owner: Any) -> property: ...
    @overload
    def __get__(self, instance: object, owner: Any) -> _Get: ...
    def __set__(self, instance: object, value: _Set) -> None: ...

class _EnumType(type):
    def __iter__(cls: Type[_T]) -> Iterator[_T]: ...
    def __len__(cls) -> int: ...

class _Rotation(Protocol):
    """Such as scipy's."""
    def as_matrix(self) -> NDArray[Any]: ...

class _Faces(Protocol):
    """A mesh of another library, such as trimesh."""
    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...

class _Cells(Protocol):
    """Such as meshio's."""
    @property
    def points(self) -> Any: ...
    @property
    def cells_dict(self) -> Any: ...

ShapeLike = Union[Shape, _Faces, _Cells]
PoseLike = Union[
    RigidPose, ArrayLike, _Rotation, Tuple[ArrayLike, ArrayLike], Tuple[_Rotation, ArrayLike]
]
IntervalLike = Union[TimeInterval, ArrayLike]
TwistLike = Union[Twist, Tuple[ArrayLike, ArrayLike], ArrayLike]
StateLike = Union[MotionState, Tuple[PoseLike, TwistLike]]
__version__: str
'''
# What pybind11 only knows as an object.
BY_NAME = {
    "copy": "Optional[bool]",
    "rotation": "Union[ArrayLike, _Rotation]",
    "progress": "Union[bool, Callable[[int, int], object], None]",
    "stop": "Optional[StopSource]",
    "out": "Optional[NDArray[Any]]",
    "accepts": "Optional[Callable[[int], bool]]",
    "paths": "Iterable[JointPath]",
    "part": "Optional[IntervalLike]",
    "srdf": "Optional[Union[str, os.PathLike[str]]]",
    "package_paths": "Iterable[Union[str, os.PathLike[str]]]",
    "file": "Union[str, os.PathLike[str]]",
    "poses": "Union[ArrayLike, Sequence[PoseLike], Tuple[ArrayLike, ArrayLike]]",
    "motions": "Sequence[Motion]",
    "device": "Union[PoseLike, DevicePose]",
    "wrench": "Optional[Callable[[float, MotionState], Union[Wrench, Tuple[ArrayLike, ArrayLike]]]]",
    "deadline": "Optional[float]",
    "forces": "Union[Sequence[SurfaceForce], Tuple[ArrayLike, ArrayLike, ArrayLike], None]",
    "shape": "Optional[Callable[[int, NDArray[numpy.float64]], Optional[ArrayLike]]]",
    "cut": "Optional[Callable[[int], Union[TissueMesh, Tuple[ArrayLike, ArrayLike], None]]]",
    "mesh_directories": "Sequence[Union[str, os.PathLike[str]]]",
}
ARRAYS = (
    "vertices triangles points points_W directions_W array begin end next_end control_points v_WB w_WB a b "
    "position quaternion interval waypoints velocities controls q heights centers"
).split()
BATCH = {
    "a": "Union[Shape, Sequence[Shape]]",
    "b": "Union[Shape, Sequence[Shape]]",
    "X_WA": "Union[Motion, Sequence[Motion], MotionArray]",
    "X_WB": "Union[Motion, Sequence[Motion], MotionArray]",
    "interval": "Union[IntervalLike, Sequence[IntervalLike]]",
}
# What classes that derive may define, which is more than calls need.
DERIVED = {
    "TissueModel.cut": "def cut(self, news: TissueNews) "
    "-> Union[TissueMesh, Tuple[ArrayLike, ArrayLike], None]: ...",
    "TissueModel.step": "def step(self, news: TissueNews, vertices: NDArray[numpy.float64]) "
    "-> Optional[ArrayLike]: ...",
}
POSES = "Union[PoseLike, Sequence[PoseLike]]"
# What may be given where the first is read.
ACCEPTED = {
    "NDArray[Any]": "ArrayLike",
    "NDArray[numpy.float64]": "ArrayLike",
    "RigidPose": "PoseLike",
    "TimeInterval": "IntervalLike",
    "Twist": "TwistLike",
    "MotionState": "StateLike",
}


def plain(text, is_result):
    """A type as pybind11 writes it, as one of Python."""
    text = text.replace("dyop._dyop.", "")
    text = re.sub(r"numpy\.ndarray\[\([^)]*\), float64\]", "@", text)
    text = re.sub(r"numpy\.ndarray\[[^\]]*\]|numpy\.ndarray|array\b", "NDArray[Any]", text)
    text = text.replace("@", "NDArray[numpy.float64]" if is_result else "ArrayLike")
    text = re.sub(r"\b(object|handle)\b", "Any", text)
    text = re.sub(r"\b[Tt]uple\b(?!\[)", "Tuple[Any, ...]", text)
    text = re.sub(r"\b([Ll]ist|Iterator|Iterable)\b(?!\[)", r"\1[Any]", text)
    text = re.sub(r"\b[Dd]ict\b(?!\[)", "Dict[str, Any]", text)
    if not is_result:
        text = re.sub(r"\bList\[", "Sequence[", text)
    return re.sub(r"\bcapsule\b|\biterator\b", "Any", text)


def accepted(kind):
    """What may be given for a value of this type."""
    several = re.fullmatch(r"tuple\[(.*), \.\.\.\]|List\[(.*)\]", kind)
    if several:
        return f"Sequence[{accepted(several[1] or several[2])}]"
    perhaps = re.fullmatch(r"Optional\[(.*)\]", kind)
    if perhaps:
        return f"Optional[{accepted(perhaps[1])}]"
    return ACCEPTED.get(kind, kind)


def split_arguments(text):
    """Splits at commas outside of brackets and strings."""
    parts, depth, start = [], 0, 0
    for i, c in enumerate(text):
        depth += (c in "([{<") - (c in ")]}>")
        if c == "," and depth == 0:
            parts.append(text[start:i])
            start = i + 1
    return [p.strip() for p in [*parts, text[start:]] if p.strip()]


def argument(text, function):
    if text in ("*", "*args", "**kwargs"):
        return {"*": "*", "*args": "*args: Any", "**kwargs": "**kwargs: Any"}[text]
    found = re.match(r"(\w+)(?:: ([^=]+?))?(?: = (.*))?$", text, re.S)
    name, kind, default = found.groups()
    kind = plain(kind or "object", False)
    if kind == "Any" and name != "self":
        kind = BY_NAME.get(name, "ArrayLike" if name in ARRAYS else "Any")
        if name.startswith("X_"):
            kind = POSES
        if function == "time_of_impact_batch":
            kind = BATCH.get(name, kind)
        if function == "distance_batch" and name in "ab":
            kind = BATCH[name]
    if function not in ("__setstate__", "view"):
        kind = re.sub(r"\bShape\b", "ShapeLike", kind)
    if default == "None" and not kind.startswith("Optional") and kind != "Any":
        kind = f"Optional[{kind}]"
    if name == "self":
        return "self"
    name = name if not re.match(r"arg\d", name) else "_" * (1 + int(name[3:]))
    return f"{name}: {kind}" + (" = ..." if default is not None else "")


def signatures(function, name):
    doc = function.__doc__ or ""
    lines = re.findall(rf"^(?:\d+\. )?{re.escape(name)}\((.*)\) -> (.*)$", doc, re.M)
    return [
        (", ".join(argument(a, name) for a in split_arguments(arguments)), plain(result, True))
        for arguments, result in lines
    ]


def write_function(out, name, function, indent, is_static=False):
    found = signatures(function, name)
    for arguments, result in found:
        # Poses are arrays, too: to mypy, what multiplies a pose by a pose also multiplies arrays.
        is_ambiguous = name == "__mul__" and arguments == "self, _: RigidPose" and len(found) > 1
        if len(found) > 1:
            out.append(f"{indent}@overload")
        if is_static:
            out.append(f"{indent}@staticmethod")
        if name == "__eq__":
            arguments, result = "self, _: object", "bool"
        comment = "  # type: ignore[misc]" if is_ambiguous else ""
        out.append(f"{indent}def {name}({arguments}) -> {result}: ...{comment}")


def property_type(value):
    return plain((value.__doc__ or "Any").split(":")[0], True)


def write_property(out, name, value):
    kind = property_type(value)
    if value.fset is not None and accepted(kind) != kind:
        out.append(f"    {name}: _Field[{kind}, {accepted(kind)}]")
        return
    if value.fset is None:
        # Most results are there whenever their status says so: who has asked need not ask again.
        kind = re.sub(r"^Optional\[(.*)\]$", r"Union[\1, Any]", kind)
    out.append(f"    @property\n    def {name}(self) -> {kind}: ...")
    if value.fset is not None:
        out.append(f"    @{name}.setter\n    def {name}(self, value: {kind}) -> None: ...")


def write_record(out, cls):
    values = {name: accepted(property_type(getattr(cls, name))) for name in cls._fields}
    listed = ", ".join(f"{name}: {kind} = ..." for name, kind in values.items())
    out.append("    _fields: ClassVar[Tuple[str, ...]]")
    out.append(f"    def __init__(self, *, {listed}) -> None: ...")
    out.append("    def asdict(self) -> Dict[str, Any]: ...")
    out.append("    def __reduce__(self) -> Tuple[Any, ...]: ...")
    out.append("    def __setstate__(self, state: Tuple[Any, ...]) -> None: ...")


def write_enum(out, cls):
    out.append("    def __init__(self, value: int) -> None: ...")
    out.append("    def __int__(self) -> int: ...")
    out.append("    def __index__(self) -> int: ...")
    out.append("    def __hash__(self) -> int: ...")
    out.append("    def __eq__(self, _: object) -> bool: ...")
    out.append("    def __ne__(self, _: object) -> bool: ...")
    out.append("    def __getstate__(self) -> int: ...")
    out.append("    def __setstate__(self, state: int) -> None: ...")
    out.append("    @property\n    def name(self) -> str: ...")
    out.append("    @property\n    def value(self) -> int: ...")
    out.append(f"    __members__: ClassVar[Dict[str, {cls.__name__}]]")
    for member in cls.__members__:
        out.append(f"    {member}: ClassVar[{cls.__name__}]")


def write_class(out, cls):
    bases = [b.__name__ for b in cls.__bases__ if b.__name__ not in ("pybind11_object", "object")]
    if hasattr(cls, "__members__"):
        bases = ["metaclass=_EnumType"]
    out.append(f"class {cls.__name__}({', '.join(bases)}):" if bases else f"class {cls.__name__}:")
    if hasattr(cls, "__members__"):
        write_enum(out, cls)
        return
    if issubclass(cls, BaseException):
        if cls.__name__ == "FileError":
            out += ["    file: str", "    line: Optional[int]", "    column: Optional[int]"]
        else:
            out.append("    ...")
        return
    is_record = "_fields" in vars(cls)
    if is_record:
        write_record(out, cls)
    for name, value in vars(cls).items():
        if is_record and name in ("__init__", "__reduce__", "__setstate__", "asdict", "_fields"):
            continue
        if isinstance(value, property):
            write_property(out, name, value)
        elif name == "__hash__" and value is None:
            out.append("    __hash__: ClassVar[None]  # type: ignore[assignment]")
        elif isinstance(value, staticmethod):
            write_function(out, name, getattr(cls, name), "    ", True)
        elif f"{cls.__name__}.{name}" in DERIVED:
            out.append("    " + DERIVED[f"{cls.__name__}.{name}"])
        elif callable(value) and (not name.startswith("__") or value.__doc__):
            write_function(out, name, value, "    ")
    if not is_record and not signatures(cls.__init__, "__init__"):  # cannot be made from Python
        out.append("    def __init__(self, *args: Any, **kwargs: Any) -> None: ...")


def main(path):
    out = []
    for name in dir(module):
        value = getattr(module, name)
        if name.startswith("_"):
            continue
        if isinstance(value, type) and value.__name__ == name:
            write_class(out, value)
        elif isinstance(value, type):
            out.append(f"{name} = {value.__name__}")
        elif callable(value):
            write_function(out, name, value, "")
        else:
            out.append(f"{name}: {type(value).__module__}.{type(value).__name__.split('[')[0]}")
    text = re.sub(r"\b(Pose|Interval|Shape|Twist|State)Like\b", r"_\1Like", HEAD + "\n".join(out) + "\n")
    with open(path, "w", encoding="utf-8") as file:
        file.write(re.sub(r"numpy\.dtype\w*", "numpy.dtype[Any]", text))


if __name__ == "__main__":
    main(sys.argv[1])
