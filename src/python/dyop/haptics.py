# SPDX-License-Identifier: BSD-3-Clause
"""The haptic loop: a tool that follows a device along proven motions only.

A loop of one's own calls HapticSession.update(); a HapticRunner runs it in a thread that never
waits for the interpreter. See docs/haptics.md.
"""

from ._dyop import (
    ContactSearch as ContactSearch,
    ContactState as ContactState,
    CouplingOptions as CouplingOptions,
    DeviceMapping as DeviceMapping,
    DeviceMappingOptions as DeviceMappingOptions,
    DevicePose as DevicePose,
    HapticOptions as HapticOptions,
    HapticRunner as HapticRunner,
    HapticScene as HapticScene,
    HapticSession as HapticSession,
    HapticStatus as HapticStatus,
    HapticTick as HapticTick,
    HapticTool as HapticTool,
    LatencyHistogram as LatencyHistogram,
    ObstacleProgress as ObstacleProgress,
    ObstacleRole as ObstacleRole,
    RunnerOptions as RunnerOptions,
    RunnerReport as RunnerReport,
    SurfacePoint as SurfacePoint,
    TickCutoff as TickCutoff,
    TickRecord as TickRecord,
    TickStatistics as TickStatistics,
    ToolClearance as ToolClearance,
    ToolContactPoint as ToolContactPoint,
    ToolHinge as ToolHinge,
    ToolImpulse as ToolImpulse,
    ToolObstacle as ToolObstacle,
    ToolPart as ToolPart,
    ToolPoint as ToolPoint,
    ToolPose as ToolPose,
    ToolRecord as ToolRecord,
    ToolTrocar as ToolTrocar,
    ToolWaypoint as ToolWaypoint,
    ToolWrench as ToolWrench,
    coupling_compliance as coupling_compliance,
    tool_jacobian as tool_jacobian,
)
