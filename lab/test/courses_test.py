"""The courses of town and meadow, for many seeds: what makes them hard, and that a robot can drive them."""
import functools
import math
import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from worlds.meadow_course import MeadowPlan, meadow_drive  # noqa: E402
from worlds.spec import Spec  # noqa: E402
from worlds.town_course import SHARED_STREET, TWIN_ROWS, TownPlan, slopes, town_drive  # noqa: E402

SEEDS = range(1, 21)


def town(seed: int, day: str = 'overcast', round_: int = 0):
    """A plan and a drive."""
    plan = TownPlan(seed)
    return plan, town_drive(plan, Spec(seed, day, round_, 1.0, 0, .07))


def samples(path, step_m: float = 1.0) -> tuple:
    """Distances, positions and headings along a path."""
    s = np.arange(0, path.length_m, step_m)
    return s, np.stack(path.point(s), 1), np.unwrap([path.at(d)[2] for d in s])


def along_street(plan: TownPlan, street: tuple, points: np.ndarray, headings: np.ndarray) -> list:
    """Runs of samples in the middle half of a street: +1 or -1 for the direction, and the mean lateral offset."""
    a, b = (np.array(plan.nodes[name]) for name in street)
    along = (b - a) / np.linalg.norm(b - a)
    share = (points - a) @ along / np.linalg.norm(b - a)
    aside = (points - a) @ np.array([-along[1], along[0]])
    on = (share > .25) & (share < .75) & (np.abs(aside) < 4)
    runs = []
    for run in np.split(np.flatnonzero(on), np.flatnonzero(np.diff(np.flatnonzero(on)) > 3) + 1):
        if len(run) > 5:
            direction = np.array([math.cos(headings[run[3]]), math.sin(headings[run[3]])]) @ along
            runs.append((int(np.sign(direction)), aside[run]))
    return runs


def crossings(points: np.ndarray) -> list:
    """Angles, in degrees, at which a closed polyline crosses itself."""
    ends, found = np.roll(points, -1, 0), []
    moves = ends - points
    for i in range(len(points)):
        others = np.arange(i + 2, len(points) - (i == 0))
        gap = points[others] - points[i]
        cross = moves[i, 0] * moves[others, 1] - moves[i, 1] * moves[others, 0]
        cross = np.where(np.abs(cross) < 1e-12, np.nan, cross)
        t = (gap[:, 0] * moves[others, 1] - gap[:, 1] * moves[others, 0]) / cross
        u = (gap[:, 0] * moves[i, 1] - gap[:, 1] * moves[i, 0]) / cross
        hit = others[(t >= 0) & (t < 1) & (u >= 0) & (u < 1)]
        for j in hit:
            cosine = abs(moves[i] @ moves[j]) / np.linalg.norm(moves[i]) / np.linalg.norm(moves[j])
            found.append(math.degrees(math.acos(min(1, cosine))))
    return found


def is_convex(points: np.ndarray) -> bool:
    """Does a closed polyline turn one way only?"""
    moves = np.roll(points, -1, 0) - points
    after = np.roll(moves, -1, 0)
    turns = moves[:, 0] * after[:, 1] - moves[:, 1] * after[:, 0]
    return bool((turns > -1e-6).all() or (turns < 1e-6).all())


def every_seed(test):
    """Runs a test of a plan and a drive for every seed."""
    @functools.wraps(test)
    def run(self):
        for seed in SEEDS:
            with self.subTest(seed=seed):
                test(self, *town(seed, round_=seed % 4))
    return run


class TownCourseTest(unittest.TestCase):
    @every_seed
    def test_is_about_700_m_long(self, plan, drive):
        self.assertAlmostEqual(drive.length_m, 700, delta=20)
        self.assertEqual(drive.count, int(drive.length_m))

    @every_seed
    def test_is_rotated_against_the_axes(self, plan, drive):
        off_axis = math.degrees(plan.turn_rad) % 90
        self.assertGreater(off_axis, 15)
        self.assertLess(off_axis, 75)

    @every_seed
    def test_is_closed_and_smooth(self, plan, drive):
        _, points, _ = samples(drive.path, .25)
        headings = np.unwrap([drive.path.at(s)[2] for s in np.arange(0, drive.length_m + 2, .25)])
        self.assertLess(np.linalg.norm(points[0] - points[-1]), .3)
        self.assertLess(np.degrees(np.abs(headings[4:] - headings[:-4])).max(), 15)

    @every_seed
    def test_is_not_convex_and_crosses_itself_at_a_junction(self, plan, drive):
        _, points, _ = samples(drive.path)
        self.assertFalse(is_convex(points))
        self.assertTrue(any(angle > 60 for angle in crossings(points)))
        near = np.linalg.norm(points - np.array(plan.nodes['22']), axis=1) < 4
        passes = np.diff(np.flatnonzero(near)) > 3
        self.assertEqual(passes.sum() + 1, 2)

    @every_seed
    def test_drives_a_street_in_both_directions(self, plan, drive):
        _, points, headings = samples(drive.path, .5)
        runs = along_street(plan, ('31', '32'), points, headings)
        self.assertEqual(sorted(direction for direction, _ in runs), [-1, 1])

    @every_seed
    def test_drives_a_street_twice_with_another_offset(self, plan, drive):
        _, points, headings = samples(drive.path, .5)
        runs = along_street(plan, SHARED_STREET, points, headings)
        self.assertEqual([direction for direction, _ in runs], [1, 1])
        apart = abs(np.mean(runs[0][1]) - np.mean(runs[1][1]))
        self.assertGreater(apart, 1)
        self.assertLess(apart, 2.5)

    def test_another_round_has_another_offset_in_the_same_town(self):
        (plan, first), (other, second) = town(1, round_=0), town(1, round_=1)
        self.assertEqual(plan.nodes, other.nodes)
        self.assertNotAlmostEqual(first.length_m, second.length_m, places=3)

    @every_seed
    def test_a_quarter_is_steep_and_nothing_too_steep(self, plan, drive):
        steep = np.abs(slopes(drive.path, plan.relief, samples(drive.path)[0]))
        self.assertGreater(((steep >= .05) & (steep <= .1)).mean(), .25)
        self.assertLess(steep.max(), .105)

    @every_seed
    def test_passes_all_twin_houses_in_the_same_direction(self, plan, drive):
        _, points, headings = samples(drive.path, .5)
        for row in TWIN_ROWS:
            self.assertEqual([direction for direction, _ in along_street(plan, row, points, headings)], [1])

    def test_the_same_place_has_the_same_height_in_every_pass(self):
        plan, drive = town(1)
        x, y = drive.path.point(np.array([10.0, drive.length_m + 10]))
        self.assertAlmostEqual(*plan.relief.height(x, y), places=9)


class PoseTest(unittest.TestCase):
    """The camera leans as the ground does."""

    def test_the_camera_follows_slope_and_pitch(self):
        plan, drive = town(3)
        for s in np.arange(0, drive.length_m, 7.3):
            pose = drive.pose(0, s)
            x, y, heading = drive.path.at(s)
            east, north = plan.relief.gradient(x, y)
            climb = math.atan(math.cos(heading) * east + math.sin(heading) * north)
            self.assertAlmostEqual(pose.pitch_rad, climb + .07, delta=.002)
            self.assertAlmostEqual(pose.roll_rad, math.atan(math.cos(heading) * north - math.sin(heading) * east),
                                   delta=.003)
            self.assertLess(abs(math.remainder(pose.yaw_rad - heading, 2 * math.pi)), .02)
            self.assertLess(math.hypot(pose.x_m - x, pose.y_m - y), .15)
            above = pose.z_m - plan.relief.height(x, y)
            self.assertAlmostEqual(above, drive.mount.height_m, delta=.01)

    def test_the_same_round_gives_the_same_poses(self):
        self.assertEqual(list(town(2)[1].poses()), list(town(2)[1].poses()))


class MeadowCourseTest(unittest.TestCase):
    def test_is_300_images_long_and_smooth(self):
        for seed in SEEDS:
            with self.subTest(seed=seed):
                drive = meadow_drive(MeadowPlan(seed), Spec(seed, 'sunny', 0, .65))
                self.assertAlmostEqual(drive.count, 300, delta=5)
                _, points, headings = samples(drive.path)
                self.assertLess(np.degrees(np.abs(np.diff(headings))).max(), 15)
                self.assertEqual(crossings(points), [])


if __name__ == '__main__':
    unittest.main(verbosity=2)
