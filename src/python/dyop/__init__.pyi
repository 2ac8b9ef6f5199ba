# SPDX-License-Identifier: BSD-3-Clause
from typing import Any, Callable, List, NamedTuple, Optional, Union

import os

from . import _dyop as _dyop
from ._dyop import *
from ._dyop import __version__ as __version__
from ._view import Page as Page, view as view

class Simulation(NamedTuple):
    totals: RunTotals
    impacts: List[ImpactEvent]
    world: World

def simulate(
    scene: Scene,
    recording: Optional[Union[str, os.PathLike[str]]] = ...,
    *,
    options: Optional[WorldOptions] = ...,
    progress: Union[bool, Callable[[float, float], object], None] = ...,
) -> Simulation: ...
def summary(scene: Scene, simulation: Simulation, started: Optional[float] = ...) -> str: ...
