# SPDX-License-Identifier: BSD-3-Clause
"""Certified continuous collision detection and stepping of rigid bodies.

Names, arguments and promises are those of the C++ library. See ``help(dyop.time_of_impact)`` and
docs/python.md.
"""

try:
    import numpy as _numpy  # noqa: F401  first, so that a missing one is named
except ImportError as error:
    raise ImportError("dyop needs numpy; on Debian: apt-get install python3-numpy") from error

from . import _dyop
from ._dyop import *  # noqa: F401,F403
from ._dyop import __version__
from ._scenes import Simulation, simulate, summary
from ._view import Page, view


class _EnumType(type(_dyop.ToiStatus)):
    """Lets one loop over the members of an enum, and count them; there are no others."""

    def __call__(cls, value):
        made = super().__call__(value)
        if made.name not in cls.__members__:
            raise _dyop.InvalidArgument(f"{value} is no {cls.__name__}")
        return made

    def __iter__(cls):
        return iter(cls.__members__.values())

    def __len__(cls):
        return len(cls.__members__)


for _enum in vars(_dyop).values():
    if isinstance(_enum, type) and hasattr(_enum, "__members__"):
        _enum.__class__ = _EnumType
del _enum

__all__ = [name for name in dir(_dyop) if not name.startswith("_")]
__all__ += ["Page", "Simulation", "simulate", "summary", "view"]
