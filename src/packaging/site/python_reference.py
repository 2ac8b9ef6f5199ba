# SPDX-License-Identifier: BSD-3-Clause
"""Writes the reference of the Python package as a page, from its docstrings.

Usage, with the built package on PYTHONPATH: python_reference.py FILE.md
"""

import inspect
import re
import sys

import dyop
from dyop import study


def text_of(doc):
    """A docstring without what pybind11 puts in front, with lines that join."""
    return re.sub(r"\s*\n\s*", " ", inspect.cleandoc(doc or "")).replace("<", "&lt;")


def forms(name, value):
    """Pairs (signature, text) of a function, one for each way to call it."""
    doc = inspect.getdoc(value) or ""
    if not re.match(rf"{re.escape(name)}\(", doc):  # written in Python
        try:
            return [(f"{name}{inspect.signature(value)}", text_of(doc))]
        except ValueError:  # a builtin that says nothing of its arguments
            return [(f"{name}()", text_of(doc))]
    pattern = rf"^(?:\d+\. )?({re.escape(name)}\(.*\) -> .*)$"
    found = re.split(pattern, doc.replace("dyop._dyop.", ""), flags=re.M)
    pairs = list(zip(found[1::2], found[2::2]))
    return [(head, text_of(body)) for head, body in pairs if "*args, **kwargs" not in head]


def short(signature):
    """Without the object itself, and without what only pybind11 would say."""
    return re.sub(r"\(self: \w+(, )?", "(", signature)


def write_callable(out, name, value):
    for signature, text in forms(name, value):
        out.append(f"\n`{short(signature)}`\n")
        if text:
            out.append(f"\n{text}\n")


def write_class(out, name, value):
    bases = [b.__name__ for b in value.__bases__ if b.__module__.startswith("dyop")]
    out.append(f"\n### {name}\n")
    derived = f"A {', '.join(f'`{base}`' for base in bases)}. " if bases else ""
    doc = (inspect.getdoc(value) or "").split("\n\nMembers:")[0]
    out.append(f"\n{derived}{text_of(doc)}\n")
    if hasattr(value, "__members__"):
        out.append("\n" + ", ".join(f"`{member}`" for member in value.__members__) + "\n")
        return
    fields = [(n, f) for n, f in vars(value).items() if isinstance(f, property)]
    if fields:
        out.append("\n| field | type | |\n|---|---|---|\n")
    for field, item in fields:
        kind, _, text = text_of(item.__doc__).partition(": ")
        out.append(f"| `{field}` | `{kind}` | {text} |\n")
    for member, item in vars(value).items():
        is_own = not member.startswith("_") and not isinstance(item, property)
        item = getattr(value, member)
        if is_own and callable(item):
            write_callable(out, member, item)
    if not hasattr(value, "_fields") and value.__init__.__doc__ and "(self" in value.__init__.__doc__:
        for signature, text in forms("__init__", value.__init__):
            made = short(signature).replace("__init__", name).removesuffix(" -> None")
            out.append(f"\n`{made}`\n\n{text}\n")


def main(path):
    out = ["# Python reference\n", "\nWritten from the docstrings; [the guide](python.md) explains.\n"]
    things = {name: getattr(dyop, name) for name in sorted(dyop.__all__)}
    classes = {n: v for n, v in things.items() if inspect.isclass(v)}
    out.append("\n## Functions\n")
    for name, value in things.items():
        if inspect.isroutine(value):
            out.append(f"\n### {name}\n")
            write_callable(out, name, value)
    out.append("\n## Studies\n")
    for name in ("map", "imap", "failures", "forget"):
        out.append(f"\n### study.{name}\n")
        write_callable(out, name, getattr(study, name))
    out.append("\n## Classes\n")
    for name, value in classes.items():
        write_class(out, name, value)
    with open(path, "w", encoding="utf-8") as file:
        file.write("".join(out))


if __name__ == "__main__":
    main(sys.argv[1])
