# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

import dyop


def test_every_motion_keeps_its_promises(all_motions, user_motion):
    for motion in [*all_motions, user_motion]:
        check = dyop.check_motion(motion, (0, 1), sample_count=50)
        assert check.fault is None, (motion, check)


def test_a_wrong_twist_is_named():
    wrong = dyop.UserMotion(
        lambda t: ((1, 0, 0, 0), (t, 0, 0)), lambda t: ((2, 0, 0), (0, 0, 0)), lambda i: (2, 0, 0, 0)
    )
    check = dyop.check_motion(wrong, (0, 1), sample_count=50)
    assert check.fault == dyop.MotionFault.TwistNotDerivative and check.message


def test_constant_twist_is_a_line_and_a_turn():
    motion = dyop.ConstantTwistMotion(np.eye(4), ((1, 2, 3), (0, 0, np.pi)), t0=1)
    pose = motion.pose(1.5)
    np.testing.assert_allclose(pose.translation, [0.5, 1, 1.5])
    np.testing.assert_allclose(pose.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    state = motion.state(1.5)
    assert state.X_WB == pose
    np.testing.assert_array_equal(state.twist.w_WB, [0, 0, np.pi])
    bound = motion.twist_bound((0, 1))
    assert bound.angular_speed >= np.pi and bound.linear_acceleration == 0


def test_a_screw_turns_and_slides():
    motion = dyop.ScrewMotion(np.eye(4), p_WA=(1, 0, 0), turn_rate=np.pi, slide_rate=2)
    np.testing.assert_allclose(motion.pose(1).translation, [2, 0, 2], atol=1e-15)
    assert motion.turn_rate == np.pi


def test_samples_and_sequences(all_motions):
    sampled = next(m for m in all_motions if isinstance(m, dyop.SampledMotion))
    np.testing.assert_array_equal(sampled.times, [0, 0.5, 1])
    np.testing.assert_allclose(sampled.pose(0.5).matrix, sampled.poses[1].matrix, atol=1e-15)
    assert sampled.smooth_until(0.1) == 0.5
    assert tuple(sampled.domain()) == (0, 1)
    with pytest.raises(dyop.InvalidArgument, match="must increase"):
        dyop.SampledMotion([0, 0], [np.eye(4), np.eye(4)])
    with pytest.raises(dyop.InvalidArgument, match="2 times but 1"):
        dyop.SampledMotion([0, 1], [np.eye(4)])
    sequence = next(m for m in all_motions if isinstance(m, dyop.SequenceMotion))
    assert sequence.parts[0][1].pose(0.25) == sequence.pose(0.25)


def test_a_long_log_passes_at_a_distance_in_few_steps():
    count = 10_000
    s = np.linspace(0, 1, count)
    still = np.tile([1.0, 0, 0, 0], (count, 1))
    places = np.stack([4 * s - 2, 1.2 + 0 * s, 0 * s], axis=1)
    places += 1e-4 * np.random.default_rng(1).standard_normal(places.shape)
    log = dyop.SampledMotion(s, (still, places))
    plate = dyop.height_field(np.zeros((30, 30)), (0.03, 0.03))
    result = dyop.time_of_impact(plate, log, plate, dyop.RestMotion(), (0, 1))
    assert result.status == dyop.ToiStatus.Separated
    assert result.statistics.node_pairs < 1000
    assert dyop.check_motion(log, (0, 1), sample_count=50).fault is None


def test_composition_multiplies_poses(all_motions):
    composed = next(m for m in all_motions if isinstance(m, dyop.ComposedMotion))
    product = composed.outer().pose(0.3) * composed.inner().pose(0.3)
    np.testing.assert_allclose(composed.pose(0.3).matrix, product.matrix, atol=1e-15)


def test_user_motion_hits_at_the_root(user_motion):
    # |t^2 - 5| = 1 + 2: at t = sqrt 2.
    wall = dyop.RestMotion(((1, 0, 0, 0), (5, 0, 0)))
    result = dyop.time_of_impact(dyop.Sphere(1), user_motion, dyop.Sphere(2), wall, (0, 3))
    assert result.status == dyop.ToiStatus.Impact
    assert result.t_safe == pytest.approx(np.sqrt(2), abs=1e-5)
    assert result.t_safe <= np.sqrt(2)


def test_an_exception_of_a_user_motion_comes_out_as_it_is():
    def fail(t):
        raise LookupError("no pose today")

    motion = dyop.UserMotion(fail, lambda t: ((0, 0, 0), (0, 0, 0)), lambda i: (0, 0, 0, 0))
    rest = dyop.RestMotion()
    with pytest.raises(LookupError, match="today"):
        dyop.time_of_impact(dyop.Sphere(1), motion, dyop.Sphere(1), rest, (0, 1))
    with pytest.raises(LookupError, match="today"):
        dyop.time_of_impact_batch(dyop.Sphere(1), [motion] * 8, dyop.Sphere(1), rest, thread_count=2)


def test_a_wrong_answer_of_a_user_motion_is_an_error():
    motion = dyop.UserMotion(lambda t: 1, lambda t: ((0, 0, 0), (0, 0, 0)), lambda i: (0, 0, 0, 0))
    with pytest.raises(dyop.InvalidArgument, match="pose must be"):
        motion.pose(0)


def test_motion_files_are_read(tmp_path):
    file = tmp_path / "motion.json"
    file.write_text('{"kind": "rest", "pose": {"position": [1, 2, 3]}}')
    motion = dyop.load_motion(file)
    assert isinstance(motion, dyop.RestMotion)
    np.testing.assert_array_equal(motion.pose(7).translation, [1, 2, 3])
    with pytest.raises(dyop.FileError):
        dyop.load_motion(tmp_path / "none.json")
