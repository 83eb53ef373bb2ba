#!/usr/bin/python3
"""Turns ALIKE's published weights into the ONNX model that `--features learned --model FILE.onnx` reads.

The network: X. Zhao et al., "ALIKE: Accurate and Lightweight Keypoint Detection and Descriptor Extraction", IEEE
Transactions on Multimedia, 2022; its small sizes (t, s, n), whose head is one 1x1 convolution. The published network
upsamples four levels to the size of the image and applies the head there. The head is linear and so is upsampling:
here each level has its own part of the head's row for scores, and the descriptors' rows leave the model as a matrix,
which the reader applies at the keypoints alone. doc/programs.md has the model's inputs and outputs.

    export_features.py alike-t.pth --output alike-t.onnx
"""
import argparse
import io
import sys
from pathlib import Path
from typing import Dict, List, Optional, Tuple

import cv2
import numpy as np

try:
    import torch
    from torch import nn
    from torch.nn import functional
except ImportError as missing:
    sys.exit(f'export_features: {missing}; on Debian: apt-get install python3-torch')

sys.path.insert(0, str(Path(__file__).resolve().parent))
from evaluation_report.data import DataError  # noqa: E402  pylint: disable=wrong-import-position
from evaluation_report.files import written_whole  # noqa: E402  pylint: disable=wrong-import-position

Weights = Dict[str, torch.Tensor]

POOLING = (1, 2, 4, 4)  # of each block's input
NORM_EPSILON = 1e-5  # batch normalisation, as in training
TOLERANCE = 1e-3  # of scores and of normalised descriptors: float arithmetic in another order gives 1e-5
OUTPUTS = ['scores', *(f'descriptors_{level}' for level in range(len(POOLING))), 'head']
CHECKED_SIZES = ((96, 160), (256, 320))  # multiples of 32, the coarsest level's stride


def tensor(weights: Weights, name: str, *shape: Optional[int]) -> torch.Tensor:
    """A tensor of the file; None: this size may be any."""
    if name not in weights:
        raise ValueError(f'there is no tensor {name}: these are not the weights of ALIKE-t, -s or -n')
    found = weights[name].float()
    if found.dim() != len(shape) or any(size not in (None, has) for size, has in zip(shape, found.shape)):
        expected = ' x '.join('any' if size is None else str(size) for size in shape)
        raise ValueError(f'{name} has the size {" x ".join(map(str, found.shape))}, expected: {expected}')
    if found.numel() == 0 or not bool(torch.isfinite(found).all()):
        raise ValueError(f'{name} holds {"a value that is not finite" if found.numel() else "no value"}')
    return found


def convolution(weight: torch.Tensor, bias: Optional[torch.Tensor] = None) -> nn.Conv2d:
    """Keeps the size of its input."""
    layer = nn.Conv2d(weight.shape[1], weight.shape[0], weight.shape[2], padding=weight.shape[2] // 2,
                      bias=bias is not None)
    layer.weight.data = weight
    if bias is not None:
        layer.bias.data = bias
    return layer


def normalised_convolution(weights: Weights, block: str, index: int, channels: int) -> nn.Conv2d:
    """A convolution of so many channels with the batch normalisation behind it."""
    kernels = tensor(weights, f'{block}.conv{index}.weight', None, channels, 3, 3)
    gain, shift, mean, variance = (tensor(weights, f'{block}.bn{index}.{name}', len(kernels))
                                   for name in ('weight', 'bias', 'running_mean', 'running_var'))
    if bool((variance < 0).any()):
        raise ValueError(f'{block}.bn{index}.running_var holds a variance below 0')
    gain = gain / torch.sqrt(variance + NORM_EPSILON)
    return convolution(kernels * gain[:, None, None, None], shift - mean * gain)


class Block(nn.Module):
    """Two convolutions; those after the first block add their input, with its channels adapted."""

    def __init__(self, weights: Weights, name: str, channels: int):
        super().__init__()
        self.first = normalised_convolution(weights, name, 1, channels)
        self.second = normalised_convolution(weights, name, 2, self.first.out_channels)
        self.adapt = None
        if name != 'block1':
            outputs = self.second.out_channels
            self.adapt = convolution(tensor(weights, f'{name}.downsample.weight', outputs, channels, 1, 1),
                                     tensor(weights, f'{name}.downsample.bias', outputs))

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        result = self.second(torch.relu(self.first(image)))
        return torch.relu(result if self.adapt is None else result + self.adapt(image))


class Alike(nn.Module):
    """The network up to its head."""

    def __init__(self, weights: Weights):
        super().__init__()
        if 'convhead1.weight' in weights:
            raise ValueError('the head has a second layer (convhead1, as in ALIKE-l): it cannot be applied level by '
                             'level; ALIKE-t, -s and -n can')
        self.blocks, self.reduce = nn.ModuleList(), nn.ModuleList()
        channels = 3
        for level in range(1, len(POOLING) + 1):
            self.blocks.append(Block(weights, f'block{level}', channels))
            channels = self.blocks[-1].second.out_channels
            self.reduce.append(convolution(tensor(weights, f'conv{level}.weight', None, channels, 1, 1)))
        first = self.blocks[0].first
        first.weight.data = first.weight.data.sum(1, keepdim=True)  # red, green and blue are the same grey
        first.in_channels = 1
        self.head = tensor(weights, 'convhead2.weight', None, sum(layer.out_channels for layer in self.reduce), 1, 1)
        if len(self.head) < 2:
            raise ValueError('convhead2.weight has one row: scores and at least one value of descriptors are expected')

    def levels(self, image: torch.Tensor) -> List[torch.Tensor]:
        """The channels of each level, at its own stride."""
        result = []
        for pooling, block, reduce in zip(POOLING, self.blocks, self.reduce):
            image = block(functional.max_pool2d(image, pooling) if pooling > 1 else image)
            result.append(torch.relu(reduce(image)))
        return result

    def published(self, image: torch.Tensor) -> Tuple[torch.Tensor, torch.Tensor]:
        """Scores and descriptors of all pixels, as the authors compute them."""
        result = functional.conv2d(upsampled(self.levels(image), image.shape[2:]), self.head)
        return torch.sigmoid(result[:, -1:]), functional.normalize(result[:, :-1], dim=1)


class FastAlike(nn.Module):
    """The same with the head taken apart."""

    def __init__(self, network: Alike):
        super().__init__()
        self.network = network
        sizes = [layer.out_channels for layer in network.reduce]
        self.score_parts = nn.ModuleList(convolution(part) for part in network.head[-1:].split(sizes, 1))
        matrix = network.head[:-1, :, 0, 0].flatten()
        # An output that does not depend on the image: not every reader returns a constant as an output.
        self.matrix = convolution(torch.zeros(len(matrix), 1, 1, 1), matrix)

    def forward(self, image: torch.Tensor) -> Tuple[torch.Tensor, ...]:
        levels = self.network.levels(image)
        stride, score = 1, None
        for pooling, level, part in zip(POOLING, levels, self.score_parts):
            stride *= pooling
            added = part(level)
            if stride > 1:
                added = functional.interpolate(added, scale_factor=stride, mode='bilinear', align_corners=True)
            score = added if score is None else score + added
        return torch.sigmoid(score), *levels, self.matrix(functional.adaptive_avg_pool2d(image, 1))


def read_weights(path: Path) -> Weights:
    """The tensors of a state dictionary by name."""
    content = io.BytesIO(path.read_bytes())
    try:
        weights = torch.load(content, map_location='cpu', weights_only=True)  # tensors alone: no code of the file runs
    except Exception as error:  # pylint: disable=broad-except  # whatever a broken file leads to
        raise ValueError('not a file of tensors as torch.save writes it') from error
    if not isinstance(weights, dict) or not all(isinstance(value, torch.Tensor) for value in weights.values()):
        raise ValueError('not a dictionary of tensors (a state_dict)')
    return weights


def upsampled(levels: List[torch.Tensor], size: torch.Size) -> torch.Tensor:
    """All levels at the size of the image, as the authors do it."""
    return torch.cat([functional.interpolate(level, size, mode='bilinear', align_corners=True) for level in levels], 1)


def difference(model: bytes, network: Alike) -> float:
    """The largest difference between the model, run by OpenCV, and the published network."""
    reader = cv2.dnn.readNetFromONNX(np.frombuffer(model, np.uint8))
    differences = []
    for height, width in CHECKED_SIZES:
        noise = np.random.default_rng(0).random((height // 4, width // 4), np.float32)
        image = cv2.resize(noise, (width, height), interpolation=cv2.INTER_CUBIC).clip(0, 1)[None, None]
        reader.setInput(image)
        scores, *levels, head = (torch.from_numpy(output) for output in reader.forward(OUTPUTS))
        channels = upsampled(levels, image.shape[2:])
        descriptors = functional.conv2d(channels, head.reshape(-1, channels.shape[1], 1, 1))
        with torch.no_grad():
            expected_scores, expected = network.published(torch.from_numpy(image))
        differences += [(scores - expected_scores).abs().max(),
                        (functional.normalize(descriptors, dim=1) - expected).abs().max()]
    return float(torch.stack(differences).max())


def onnx_model(network: Alike) -> bytes:
    """The network in the fast form."""
    axes = {name: {2: f'{name}_height', 3: f'{name}_width'} for name in ['image', *OUTPUTS[:-1]]}
    stream = io.BytesIO()
    torch.onnx.export(FastAlike(network).eval(), torch.zeros(1, 1, *CHECKED_SIZES[0]), stream, opset_version=11,
                      input_names=['image'], output_names=OUTPUTS, dynamic_axes=axes)
    return stream.getvalue()


def export(weights: Path, output: Path) -> str:
    """Writes the model; says what it is. A model that OpenCV runs differently is not written."""
    network = Alike(read_weights(weights)).eval()
    model = onnx_model(network)
    worst = difference(model, network)
    if not worst < TOLERANCE:
        raise ValueError(f'OpenCV {cv2.__version__} computes other scores or descriptors than torch: they differ by '
                         f'{worst:.2g}, at most {TOLERANCE:g} is expected')
    with written_whole(output) as partial:
        partial.write_bytes(model)
    return (f'{output}: descriptors of {network.head.shape[0] - 1} values, {len(model) / 1e3:.0f} kB; differs from the '
            f'published network by at most {worst:.1g} in OpenCV {cv2.__version__}')


def main() -> int:
    """Runs it; one line for what goes wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('weights', type=Path, help='state dictionary as published, for example alike-t.pth')
    parser.add_argument('--output', type=Path, required=True, help='ONNX file to write')
    options = parser.parse_args()
    cv2.setLogLevel(0)  # what goes wrong is said once, below
    try:
        print(export(options.weights, options.output))
        return 0
    except DataError as error:
        message = str(error)
    except OSError as error:
        message = f'{error.filename}: {error.strerror}'
    except (ValueError, RuntimeError, cv2.error) as error:
        message = f'{options.weights}: {" ".join(str(error).split())}'
    print(f'export_features: {message}', file=sys.stderr)
    return 1


if __name__ == '__main__':
    sys.exit(main())
