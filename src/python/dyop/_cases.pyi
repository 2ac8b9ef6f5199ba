# SPDX-License-Identifier: BSD-3-Clause
from typing import Any, Callable, Mapping, Optional, Tuple

class CaseLost(RuntimeError): ...

def run_isolated(
    function: Callable[..., Any],
    shared: Mapping[str, Any],
    key: str,
    case: Any,
    seconds: Optional[float],
    megabytes: Optional[float],
) -> Tuple[bool, Any]: ...
def drop() -> None: ...
def serve(descriptor: int) -> None: ...
