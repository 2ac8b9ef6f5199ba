# SPDX-License-Identifier: BSD-3-Clause
"""The stubs are what the module says of itself, and everything says something."""

import inspect
from pathlib import Path

import dyop
import make_stubs


def test_stubs_are_up_to_date(tmp_path):
    make_stubs.main(tmp_path / "_dyop.pyi")
    written = (tmp_path / "_dyop.pyi").read_text()
    kept = (Path(dyop.__file__).parent / "_dyop.pyi").read_text()
    assert kept == written, "run tests/python/make_stubs.py src/python/dyop/_dyop.pyi"


def test_every_function_and_class_has_a_docstring():
    for name in dyop.__all__:
        value = getattr(dyop, name)
        if inspect.isroutine(value):
            assert "\n\n" in value.__doc__, name  # more than the signature
        elif inspect.isclass(value):
            assert value.__doc__, name
            for member, field in vars(value).items():
                if isinstance(field, property) and not hasattr(value, "__members__"):
                    kind, colon, _ = (field.__doc__ or "").partition(":")
                    assert kind and colon, f"{name}.{member}"
