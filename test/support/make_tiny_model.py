#!/usr/bin/python3
"""Writes test/data/models/tiny.onnx: the smallest model of local features that finds places again, without learning.

Scores: blobs by a difference of Gaussians. Descriptors: gradients in eight directions, averaged over cells of 4 px
around the keypoint (descriptors_0) and of 8 px at it (descriptors_1), projected on 32 values (head). The contract is in
doc/programs.md.
"""
import sys
from typing import List

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

DIRECTIONS = 8
CORNERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))  # cells beside the keypoint's
CHANNELS = (DIRECTIONS * len(CORNERS), DIRECTIONS)
VALUES = 32


def gaussian(sigma: float, radius: int) -> np.ndarray:
    """A kernel with the sum 1."""
    line = np.exp(-.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    kernel = np.outer(line, line)
    return kernel / kernel.sum()


def directional_gradients() -> np.ndarray:
    """A kernel for each direction."""
    across = np.outer((1, 2, 1), (-1, 0, 1)) / 8
    angles = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    return np.stack([np.cos(angle) * across + np.sin(angle) * across.T for angle in angles])[:, None]


def neighbours() -> np.ndarray:
    """Moves the cells beside the keypoint's to it."""
    kernels = np.zeros((CHANNELS[0], DIRECTIONS, 3, 3))
    for corner, (down, across) in enumerate(CORNERS):
        for direction in range(DIRECTIONS):
            kernels[corner * DIRECTIONS + direction, direction, 1 + down, 1 + across] = 1
    return kernels


def projection() -> np.ndarray:
    """Random rows without a common part: what all directions share says nothing."""
    rows = np.random.default_rng(7).normal(size=(VALUES, sum(CHANNELS)))
    return rows - rows.mean(axis=1, keepdims=True)


def convolution(image: str, kernels: str, result: str, side: int, offset: str = '') -> onnx.NodeProto:
    """Keeps the size of its input; OpenCV wants the kernel's size written down."""
    return helper.make_node('Conv', [image, kernels] + [offset] * bool(offset), [result], kernel_shape=[side, side],
                            pads=[side // 2] * 4)


def make_model() -> onnx.ModelProto:
    """The graph."""
    difference = (gaussian(1, 3) - gaussian(2, 3))[None, None]
    head = projection().ravel()
    constants = {'blobs': np.concatenate((difference, -difference)), 'sum': np.full((1, 2, 1, 1), 60.0),
                 'offset': np.array([-4.0]), 'gradients': directional_gradients(), 'neighbours': neighbours(),
                 'nothing': np.zeros((len(head), 1, 1, 1)), 'matrix': head}
    nodes: List[onnx.NodeProto] = [
        convolution('image', 'blobs', 'signed', 7),
        helper.make_node('Relu', ['signed'], ['positive']),
        convolution('positive', 'sum', 'logits', 1, 'offset'),
        helper.make_node('Sigmoid', ['logits'], ['scores']),
        convolution('image', 'gradients', 'directions', 3),
        helper.make_node('Relu', ['directions'], ['strengths']),
        helper.make_node('AveragePool', ['strengths'], ['cells'], kernel_shape=[4, 4], strides=[4, 4]),
        convolution('cells', 'neighbours', 'descriptors_0', 3),
        helper.make_node('AveragePool', ['cells'], ['descriptors_1'], kernel_shape=[2, 2], strides=[2, 2]),
        helper.make_node('GlobalAveragePool', ['image'], ['mean']),
        convolution('mean', 'nothing', 'head', 1, 'matrix'),
    ]
    shapes = {'scores': (1, 'H', 'W'), 'descriptors_0': (CHANNELS[0], 'H/4', 'W/4'),
              'descriptors_1': (CHANNELS[1], 'H/8', 'W/8'), 'head': (len(head), 1, 1)}
    graph = helper.make_graph(
        nodes, 'tiny', [helper.make_tensor_value_info('image', TensorProto.FLOAT, (1, 1, 'H', 'W'))],
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, (1, *shape)) for name, shape in shapes.items()],
        [numpy_helper.from_array(value.astype(np.float32), name) for name, value in constants.items()])
    model = helper.make_model(graph, producer_name='make_tiny_model', opset_imports=[helper.make_opsetid('', 11)])
    model.ir_version = 6
    onnx.checker.check_model(model)
    return model


if __name__ == '__main__':
    if len(sys.argv) != 2:
        sys.exit('usage: make_tiny_model.py OUTPUT.onnx')
    onnx.save(make_model(), sys.argv[1])
