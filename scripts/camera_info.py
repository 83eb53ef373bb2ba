"""Calibration files of camera_calibration as messages, for the scripts that write bags."""
from pathlib import Path

import yaml
from sensor_msgs.msg import CameraInfo

TOPIC = '/stereo/left/camera_info'


def read_camera_info(path: Path) -> CameraInfo:
    """The message that a camera driver publishes when it is given this file, without a stamp."""
    with open(path, encoding='utf-8') as file:
        calibration = yaml.safe_load(file)
    info = CameraInfo(width=calibration['image_width'], height=calibration['image_height'],
                      distortion_model=calibration['distortion_model'])
    info.header.frame_id = calibration['camera_name']
    for field, key in (('D', 'distortion_coefficients'), ('K', 'camera_matrix'), ('R', 'rectification_matrix'),
                       ('P', 'projection_matrix')):
        setattr(info, field, [float(value) for value in calibration[key]['data']])
    return info
