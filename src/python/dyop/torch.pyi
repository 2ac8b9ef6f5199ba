# SPDX-License-Identifier: BSD-3-Clause
from typing import NamedTuple, Optional

import torch  # type: ignore[import]

from ._dyop import ToiOptions, _ShapeLike

class FlaggedDerivative(RuntimeError): ...

class Differentiable(NamedTuple):
    value: torch.Tensor
    is_proven: torch.Tensor

def distance(
    a: _ShapeLike,
    X_WA: torch.Tensor,
    b: _ShapeLike,
    X_WB: torch.Tensor,
    *,
    tolerance: float = ...,
    use_flagged: bool = ...,
) -> Differentiable: ...
def time_of_impact(
    a: _ShapeLike,
    X_WA: torch.Tensor,
    V_WA: torch.Tensor,
    b: _ShapeLike,
    X_WB: torch.Tensor,
    V_WB: torch.Tensor,
    duration: float,
    *,
    options: Optional[ToiOptions] = ...,
    tolerance: float = ...,
    use_flagged: bool = ...,
) -> Differentiable: ...
