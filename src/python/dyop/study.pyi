# SPDX-License-Identifier: BSD-3-Clause
from typing import Any, Callable, Dict, Generator, Iterable, List, Mapping, NamedTuple, Optional, Sequence, Tuple, TypeVar, Union

import os

_Case = TypeVar("_Case")
_Progress = Union[bool, Callable[[int, int], object]]

class Failure(NamedTuple):
    case: int
    error: str

class StudyError(RuntimeError): ...

class Store:
    def __init__(self, path: Union[str, os.PathLike[str]], name: str) -> None: ...
    def load(self, digests: Sequence[str]) -> Dict[int, Any]: ...
    def save(self, rows: Iterable[Tuple[int, str, Any]]) -> None: ...
    def close(self) -> None: ...

def imap(
    function: Callable[..., Any],
    cases: Iterable[_Case],
    *,
    client: Any = ...,
    shared: Optional[Mapping[str, Any]] = ...,
    chunk: int = ...,
    store: Optional[Union[str, os.PathLike[str]]] = ...,
    keep_failures: bool = ...,
    seconds: Optional[float] = ...,
    megabytes: Optional[float] = ...,
    isolate: Optional[bool] = ...,
    progress: _Progress = ...,
    patience: float = ...,
) -> Generator[Tuple[int, Any], None, None]: ...
def map(function: Callable[..., Any], cases: Iterable[_Case], **options: Any) -> List[Any]: ...
def failures(results: Iterable[Any]) -> List[Failure]: ...
def forget(client: Any) -> None: ...
