# SPDX-License-Identifier: BSD-3-Clause
"""Distances and times of impact that PyTorch differentiates. Needs torch.

Values and gradients are those of dyop.distance_derivatives() and dyop.impact_derivatives(): see
docs/python.md.
"""

import functools
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from . import _dyop

# A matrix in single precision is a rotation to this; what is farther off is refused.
_NEARLY_ROTATION = 1e-4


class FlaggedDerivative(RuntimeError):
    """A gradient was asked for that is not proven: the distance has a corner there, the shapes
    touch, or they graze each other."""


class Differentiable(NamedTuple):
    """Numbers that can be differentiated, and where their derivatives are proven."""

    value: torch.Tensor
    is_proven: torch.Tensor  # bool, of the same shape


def distance(a, X_WA, b, X_WB, *, tolerance=1e-3, use_flagged=False):
    """Distances of two shapes at many poses, to be differentiated by the poses.

    X_WA, X_WB: (..., 4, 4) homogeneous matrices, float32 or float64 on any device; leading
    dimensions broadcast. Rotations in single precision are made orthonormal first. The gradient by
    a rotation matrix is along the rotations: right for whatever the matrix was computed from.

    tolerance: relative error up to which a derivative counts as proven. The backward pass raises
    FlaggedDerivative where a derivative is needed that is not; with use_flagged it takes the
    gradient of one of the nearest pairs instead, and zero where shapes touch.

    The value is the length between the witness points, 0 for overlapping shapes. Cost: 13 distances
    a pose, 12 of them warm.
    """
    X_WA, X_WB = _broadcast(X_WA, X_WB, (4, 4), (4, 4), ("X_WA", "X_WB"))
    return Differentiable(*_Distance.apply(X_WA, X_WB, a, b, tolerance, use_flagged))


def time_of_impact(
    a, X_WA, V_WA, b, X_WB, V_WB, duration, *, options=None, tolerance=1e-2, use_flagged=False
):
    """Times of impact of two shapes that move with constant twists, to be differentiated by where
    they start and by their twists.

    X_WA, X_WB: (..., 4, 4) poses at time 0, as for distance().
    V_WA, V_WB: (..., 6) twists: velocity of the body's origin, then angular velocity, in world.

    The value is t_safe, up to which shapes are proven apart, rounded to the tensors' precision:
    infinite where they do not meet within the duration, with a gradient of zero that is proven as
    well; 0, not proven, where they start within the target distance. FlaggedDerivative as for
    distance().

    Raises RuntimeError if a query does not come to an answer within the budget of the options.
    """
    X_WA, X_WB = _broadcast(X_WA, X_WB, (4, 4), (4, 4), ("X_WA", "X_WB"))
    V_WA, V_WB = _broadcast(V_WA, V_WB, (6,), (6,), ("V_WA", "V_WB"))
    X_WA, V_WA = _broadcast(X_WA, V_WA, (4, 4), (6,), ("poses", "twists"))
    X_WB, V_WB = _broadcast(X_WB, V_WB, (4, 4), (6,), ("poses", "twists"))
    return Differentiable(
        *_TimeOfImpact.apply(
            X_WA, V_WA, X_WB, V_WB, a, b, float(duration), options, tolerance, use_flagged
        )
    )


def _broadcast(x, y, x_shape, y_shape, names):
    for tensor, shape, name in ((x, x_shape, names[0]), (y, y_shape, names[1])):
        if not isinstance(tensor, torch.Tensor):
            raise TypeError(f"{name} must be a tensor, not a value of type {type(tensor).__name__}")
        if tensor.dtype not in (torch.float32, torch.float64):
            raise _dyop.InvalidArgument(f"{name} must be float32 or float64, not {tensor.dtype}")
        if tuple(tensor.shape[-len(shape) :]) != shape:
            wanted = "x".join(str(n) for n in shape)
            raise _dyop.InvalidArgument(
                f"{name} must end in a shape of {wanted}, not be {tuple(tensor.shape)}"
            )
    try:
        lead = torch.broadcast_shapes(x.shape[: -len(x_shape)], y.shape[: -len(y_shape)])
    except RuntimeError as error:
        raise _dyop.InvalidArgument(
            f"the leading dimensions of {names[0]} {tuple(x.shape)} and of {names[1]} "
            f"{tuple(y.shape)} do not broadcast"
        ) from error
    return x.expand(*lead, *x_shape), y.expand(*lead, *y_shape)


def _rows(tensor, *shape):
    return tensor.detach().to("cpu", torch.float64).reshape(-1, *shape).numpy()


def _poses(tensor):
    """(N, 4, 4) poses, rotations made orthonormal if they nearly are."""
    X = _rows(tensor, 4, 4).copy()
    finite = np.isfinite(X).all(axis=(1, 2))  # others are refused, by their number
    U, sizes, V = np.linalg.svd(np.where(finite[:, None, None], X[:, :3, :3], 0))
    near = np.abs(sizes - 1).max(axis=1, initial=0) <= _NEARLY_ROTATION
    X[near, :3, :3] = (U @ V)[near]
    near = np.abs(X[:, 3] - (0, 0, 0, 1)).max(axis=1, initial=0) <= _NEARLY_ROTATION
    X[near, 3] = (0, 0, 0, 1)
    return X


@contextmanager
def _numbered(index):
    """Says in which of many queries an argument does not fit."""
    try:
        yield
    except _dyop.InvalidArgument as error:
        raise _dyop.InvalidArgument(f"number {index}: {error}") from error


def _by_entries(X, gradients):
    """Gradients by the entries of poses X, (N, 4, 4), from those by translation and turn about the
    body's origin, (N, 6).

    A turn w changes R by [w] R, and the sum of the entries of [g] R times those of [w] R is
    2 g . w.
    """
    result = np.zeros(X.shape)
    result[:, :3, :3] = 0.5 * np.cross(gradients[:, 3:, None], X[:, :3, :3], axis=1)
    result[:, :3, 3] = gradients[:, :3]
    return result


def _refuse_flagged(upstream, statuses):
    proven = _dyop.DerivativeStatus.Proven
    for index in np.flatnonzero(upstream):
        if statuses[index] != proven:
            raise FlaggedDerivative(
                f"the derivative of number {index} is not proven: {statuses[index].name}; "
                "leave it out by is_proven, or allow it by use_flagged=True"
            )


class _Queries(torch.autograd.Function):
    """Queries one after the other: `ctx.grads` are their gradients by each of the tensors."""

    @staticmethod
    def finish(ctx, tensors, values, statuses, use_flagged):
        ctx.tensors, ctx.statuses, ctx.use_flagged = tensors, statuses, use_flagged
        dtype = functools.reduce(torch.promote_types, (tensor.dtype for tensor in tensors))
        shape, device = tensors[0].shape[:-2], tensors[0].device
        value = torch.tensor(values, dtype=dtype, device=device).reshape(shape)
        proven = [status == _dyop.DerivativeStatus.Proven for status in statuses]
        is_proven = torch.tensor(proven, dtype=torch.bool, device=device).reshape(shape)
        ctx.mark_non_differentiable(is_proven)
        return value, is_proven

    @staticmethod
    @once_differentiable
    def backward(ctx, of_value, _):
        upstream = _rows(of_value)
        if not ctx.use_flagged:
            _refuse_flagged(upstream, ctx.statuses)
        grads = [
            _weighted(rows, upstream, tensor) if is_needed else None
            for rows, tensor, is_needed in zip(ctx.grads, ctx.tensors, ctx.needs_input_grad)
        ]
        return (*grads, *[None] * (len(ctx.needs_input_grad) - len(grads)))


def _weighted(rows, weights, like):
    total = np.zeros(rows.shape)
    needed = weights != 0  # other rows may be infinite
    total[needed] = weights[needed].reshape(-1, *(1,) * (rows.ndim - 1)) * rows[needed]
    return torch.as_tensor(total, dtype=like.dtype, device=like.device).reshape(like.shape)


def _six(gradient):
    return (*gradient.translation, *gradient.rotation)


class _Distance(_Queries):
    @staticmethod
    def forward(ctx, X_WA, X_WB, a, b, tolerance, use_flagged):
        values, statuses = [], []
        poses = _poses(X_WA), _poses(X_WB)
        gradients = np.zeros((2, len(poses[0]), 6))
        for index, (A, B) in enumerate(zip(*poses)):
            with _numbered(index):
                found = _dyop.distance_derivatives(a, A, b, B, tolerance=tolerance)
            values.append(found.distance.upper)
            statuses.append(found.status)
            gradients[:, index] = _six(found.by_a), _six(found.by_b)
        ctx.grads = [_by_entries(X, rows) for X, rows in zip(poses, gradients)]
        return _Queries.finish(ctx, (X_WA, X_WB), values, statuses, use_flagged)


class _TimeOfImpact(_Queries):
    @staticmethod
    def forward(ctx, X_WA, V_WA, X_WB, V_WB, a, b, duration, options, tolerance, use_flagged):
        values, statuses = [], []
        poses = _poses(X_WA), _poses(X_WB)
        by_start, by_twist = np.zeros((2, 2, len(poses[0]), 6))  # of A and B
        inputs = zip(poses[0], _rows(V_WA, 6), poses[1], _rows(V_WB, 6))
        for index, (A, v_a, B, v_b) in enumerate(inputs):
            with _numbered(index):
                motions = (
                    _dyop.ConstantTwistMotion(A, (v_a[:3], v_a[3:])),
                    _dyop.ConstantTwistMotion(B, (v_b[:3], v_b[3:])),
                )
                met = _dyop.time_of_impact(a, motions[0], b, motions[1], (0, duration), options)
                value, status, *gradients = _impact(a, b, motions, met, tolerance, index)
            values.append(value)
            statuses.append(status)
            for k, (motion, gradient) in enumerate(zip(motions, gradients)):
                by_start[k, index], by_twist[k, index] = _by_motion(motion, value, gradient)
        starts = [_by_entries(X, rows) for X, rows in zip(poses, by_start)]
        ctx.grads = starts[0], by_twist[0], starts[1], by_twist[1]
        return _Queries.finish(ctx, (X_WA, V_WA, X_WB, V_WB), values, statuses, use_flagged)


def _impact(a, b, motions, met, tolerance, index):
    """The time, whether its gradients may be used, and these by the poses at that time."""
    none = _dyop.PoseGradient()
    if met.status == _dyop.ToiStatus.Separated:
        return np.inf, _dyop.DerivativeStatus.Proven, none, none
    if met.status == _dyop.ToiStatus.InitiallyWithinTarget:
        return 0.0, _dyop.DerivativeStatus.Touching, none, none
    if met.status != _dyop.ToiStatus.Impact:
        raise RuntimeError(f"time of impact of number {index}: {met.status.name}")
    found = _dyop.impact_derivatives(a, motions[0], b, motions[1], met, tolerance=tolerance)
    return met.t_safe, found.status, found.by_a, found.by_b


def _by_motion(motion, t, gradient):
    """The gradients by the start pose and by the twist, from that by the pose at time t."""
    by_start, by_twist = np.zeros(6), np.zeros(6)
    if np.isfinite(t):
        nothing = (np.zeros(3), np.zeros(3))
        for k, unit in enumerate(np.eye(6)):
            change = (unit[:3], unit[3:])
            by_start[k] = gradient.along(motion.pose_change(t, change, nothing))
            by_twist[k] = gradient.along(motion.pose_change(t, nothing, change))
    return by_start, by_twist
