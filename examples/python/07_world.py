# SPDX-License-Identifier: BSD-3-Clause
"""7. Bodies that fall, bounce and rest, with a force written in Python."""

import dyop

world = dyop.World(dyop.WorldOptions(gravity_W=(0, 0, -9.81), max_step=0.01, target_distance=1e-4))
ground = world.add_body(
    name="ground",
    kind=dyop.BodyKind.Static,
    shape=dyop.Box([5, 5, 0.5]),
    initial=dyop.MotionState(X_WB=((1, 0, 0, 0), (0, 0, -0.5))),
)


def breeze(t: float, state: dyop.MotionState) -> dyop.Wrench:
    """Pushes along x against a drag, through the centre of mass."""
    return dyop.Wrench(force=(0.2, 0, 0) - 0.1 * state.twist.v_WB)


cube = dyop.Box([0.2, 0.2, 0.2])
body = world.add_body(
    name="cube",
    shape=cube,
    mass_properties=cube.compute_mass_properties(density=10),
    initial=dyop.MotionState(X_WB=((1, 0, 0, 0), (0, 0, 2))),
    wrench=breeze,
    restitution=0.3,
)

for second in range(1, 4):
    report = world.advance(1.0)
    x, _, z = world.state(body).X_WB.translation
    print(
        f"t = {world.time():g}: {report.status.name}, {len(report.impacts)} impacts, "
        f"x = {x:.3f}, z = {z:.4f}, kinetic energy {world.kinetic_energy():.4f}"
    )

for record in world.contacts():
    names = [world.body(id).name for id in (record.a, record.b)]
    print(*names, f"touch at {len(record.contacts)} points, gap >= {record.gap_lower:.1e}")
# Prints:
# t = 1: Completed, 2 impacts, x = 0.076, z = 0.2121, kinetic energy 0.0080
# t = 2: Completed, 1 impacts, x = 0.078, z = 0.2005, kinetic energy 0.0000
# t = 3: Completed, 0 impacts, x = 0.078, z = 0.2005, kinetic energy 0.0000
# ground cube touch at 4 points, gap >= 5.0e-04
