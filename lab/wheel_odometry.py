"""Odometry of wheels that slip, for the scripts that write bags: seeded errors, and a covariance that knows them."""
import math
from dataclasses import dataclass
from typing import List

import numpy as np
from geometry_msgs.msg import Quaternion
from nav_msgs.msg import Odometry

TOPIC = '/odom'
RATE_HZ = 10.0
SCALE_ERROR = .01  # of the distance: tyres wear and slip
DRIFT_RAD_S = math.radians(2) / 60  # of the heading
HEADING_NOISE_RAD = math.radians(.3)  # a square root of a metre
DISTANCE_NOISE_M = .02  # a square root of a metre
SLOPE_ERROR = .004  # wheels count metres of road, the covariance is about metres on the map
PLACE_NOISE_M = .06  # the camera sways above the wheels
UNKNOWN = 1e6  # variance of what wheels cannot tell


@dataclass
class Steps:
    """What a robot drives between two messages."""

    stamps: np.ndarray  # of the messages; one more than steps
    distance: np.ndarray
    heading: np.ndarray  # in the middle of each step, of the direction of travel


def drive_steps(stamps: np.ndarray, positions: np.ndarray) -> Steps:
    """Steps along a smooth curve (Catmull-Rom) through positions, of which rows are east, north and up."""
    times = np.arange(stamps[0], stamps[-1], 1 / RATE_HZ)
    index = np.clip(np.searchsorted(stamps, times, side='right') - 1, 0, len(stamps) - 2)
    slopes = np.gradient(positions, stamps, axis=0)
    gap = (stamps[index + 1] - stamps[index])[:, None]
    u = (times - stamps[index])[:, None] / gap
    points = ((1 + 2 * u) * (1 - u) ** 2 * positions[index] + u * (1 - u) ** 2 * gap * slopes[index]
              + u * u * (3 - 2 * u) * positions[index + 1] + u * u * (u - 1) * gap * slopes[index + 1])
    moves = np.diff(points, axis=0)
    return Steps(times, np.linalg.norm(moves, axis=1), np.unwrap(np.arctan2(moves[:, 1], moves[:, 0])))


@dataclass
class Track:
    """The estimate and its covariance of x, y and heading, one a message."""

    stamps: np.ndarray
    poses: np.ndarray
    covariances: np.ndarray
    speeds: np.ndarray
    yaw_rates: np.ndarray


def estimate(steps: Steps, rng: np.random.Generator) -> Track:
    """Dead reckoning from the first pose, in a frame whose x axis is the first heading."""
    scale, drift = SCALE_ERROR * rng.choice([-1, 1]), DRIFT_RAD_S * rng.choice([-1, 1])
    periods, count = np.diff(steps.stamps), len(steps.distance)
    root = np.sqrt(steps.distance)
    distance = steps.distance * (1 + scale) + DISTANCE_NOISE_M * root * rng.standard_normal(count)
    turned = np.diff(steps.heading, prepend=steps.heading[0])
    turned = turned + drift * periods + HEADING_NOISE_RAD * root * rng.standard_normal(count)
    heading = np.cumsum(turned)
    poses, covariances = np.zeros((count + 1, 3)), np.zeros((count + 1, 3, 3))
    # Sensitivity to the two constant errors, and the covariance of the noise.
    constants, noise = np.zeros((3, 2)), np.zeros((3, 3))
    variances = np.diag([SCALE_ERROR ** 2 + SLOPE_ERROR ** 2, DRIFT_RAD_S ** 2])
    for k in range(count):
        c, s = math.cos(heading[k]), math.sin(heading[k])
        ahead, aside = np.array([c, s, 0]) * distance[k], np.array([-s, c, 0]) * distance[k]
        constants[2, 1] += periods[k]
        noise[2, 2] += HEADING_NOISE_RAD ** 2 * steps.distance[k]
        move = np.eye(3)
        move[:2, 2] = aside[:2]
        constants = move @ constants
        constants[:, 0] += ahead
        noise = move @ noise @ move.T
        noise += np.outer(ahead, ahead) / max(distance[k] ** 2, 1e-12) * DISTANCE_NOISE_M ** 2 * steps.distance[k]
        poses[k + 1] = (*(poses[k, :2] + ahead[:2]), heading[k])
        covariances[k + 1] = constants @ variances @ constants.T + noise
    covariances[:, range(3), range(3)] += (PLACE_NOISE_M ** 2, PLACE_NOISE_M ** 2, HEADING_NOISE_RAD ** 2)
    speeds, rates = distance / periods, turned / periods
    return Track(steps.stamps, poses, covariances, np.append(speeds[:1], speeds), np.append(0, rates))


def messages(track: Track) -> List[Odometry]:
    """One message a pose, without a stamp."""
    result = []
    for pose, covariance, speed, rate in zip(track.poses, track.covariances, track.speeds, track.yaw_rates):
        message = Odometry(child_frame_id='base_link')
        message.header.frame_id = 'odom'
        message.pose.pose.position.x, message.pose.pose.position.y = float(pose[0]), float(pose[1])
        message.pose.pose.orientation = Quaternion(0, 0, math.sin(pose[2] / 2), math.cos(pose[2] / 2))
        full = np.diag([0, 0, UNKNOWN, UNKNOWN, UNKNOWN, 0.0])
        full[np.ix_((0, 1, 5), (0, 1, 5))] = covariance
        message.pose.covariance = full.ravel().tolist()
        message.twist.twist.linear.x, message.twist.twist.angular.z = float(speed), float(rate)
        step = max(abs(speed), .01) / RATE_HZ
        variances = [(SCALE_ERROR * speed) ** 2 + DISTANCE_NOISE_M ** 2 * step * RATE_HZ ** 2, 1e-4, UNKNOWN, UNKNOWN,
                     UNKNOWN, DRIFT_RAD_S ** 2 + HEADING_NOISE_RAD ** 2 * step * RATE_HZ ** 2]
        message.twist.covariance = np.diag(variances).ravel().tolist()
        result.append(message)
    return result


def events(stamps: np.ndarray, positions: np.ndarray, rng: np.random.Generator) -> List[tuple]:
    """Stamp, topic and message of the whole drive."""
    track = estimate(drive_steps(stamps, positions), rng)
    return [(stamp, TOPIC, message) for stamp, message in zip(track.stamps, messages(track))]
