# SPDX-License-Identifier: BSD-3-Clause
from typing import Any, Optional, Union

import os

from ._dyop import _IntervalLike

class Page:
    html: str
    height: int
    def __init__(self, html: str, height: int = ...) -> None: ...
    def save(self, file: Union[str, os.PathLike[str]]) -> None: ...
    def show(self) -> None: ...
    def _repr_html_(self) -> str: ...

def view(
    thing: Any,
    at: Any = ...,
    *,
    among: Any = ...,
    interval: Optional[_IntervalLike] = ...,
    title: Optional[str] = ...,
    height: int = ...,
) -> Page: ...
def repr_html(thing: Any) -> Optional[str]: ...
