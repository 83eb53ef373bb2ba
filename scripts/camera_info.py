"""Calibration files of camera_calibration or OpenCV as messages, for the scripts that write bags."""
from pathlib import Path

import yaml
from sensor_msgs.msg import CameraInfo

TOPIC = '/stereo/left/camera_info'


def read_camera_info(path: Path) -> CameraInfo:
    """The message that a camera driver publishes when it is given this file, without a stamp. OpenCV writes neither R
    and P nor what the distortion is called."""
    with open(path, encoding='utf-8') as file:
        text = file.read()
    if text.startswith('%YAML:'):
        text = text.partition('\n')[2].replace('!!opencv-matrix', '')
    calibration = yaml.safe_load(text)

    def values(key: str, otherwise: list) -> list:
        return [float(value) for value in calibration[key]['data']] if key in calibration else otherwise

    matrix, coefficients = (values(key, []) for key in ('camera_matrix', 'distortion_coefficients'))
    fx, fy, cx, cy = (matrix[index] for index in (0, 4, 2, 5))
    info = CameraInfo(width=calibration['image_width'], height=calibration['image_height'], K=matrix, D=coefficients,
                      R=values('rectification_matrix', [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
                      P=values('projection_matrix', [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]))
    info.distortion_model = calibration.get(
        'distortion_model', 'plumb_bob' if len(coefficients) <= 5 else 'rational_polynomial')
    info.header.frame_id = calibration.get('camera_name', 'camera')
    return info
