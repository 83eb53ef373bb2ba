"""export_features.py against ALIKE written down a second time, layer by layer; the tiny model; damaged weights."""
import contextlib
import io
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import cv2
import numpy as np

try:
    import torch
    from onnx import load, numpy_helper
    from torch.nn import functional
except ImportError as missing:
    print(f'skipped: {missing}')
    sys.exit(77)

SCRIPTS, TEST = Path(sys.argv[1]), Path(sys.argv[2])
sys.path.insert(0, str(SCRIPTS))
import export_features  # noqa: E402
PUBLISHED = Path(os.environ.get('VISUAL_LOCALIZATION_DATA', '/nonexistent')) / 'models' / 'alike-t.pth'
CHANNELS, DIMENSION = (3, 8, 16, 32, 64), 64


def random_weights() -> dict:
    """Of the sizes of ALIKE-t, as a training might leave them."""
    generator = torch.Generator().manual_seed(3)
    weights = {}

    def add(name: str, *shape: int):
        weights[name] = torch.randn(*shape, generator=generator) / max(1, np.prod(shape[1:])) ** .5

    for level, (inputs, outputs) in enumerate(zip(CHANNELS, CHANNELS[1:]), start=1):
        for index, channels in ((1, inputs), (2, outputs)):
            add(f'block{level}.conv{index}.weight', outputs, channels, 3, 3)
            for part in ('weight', 'bias', 'running_mean'):
                add(f'block{level}.bn{index}.{part}', outputs)
            weights[f'block{level}.bn{index}.running_var'] = torch.rand(outputs, generator=generator) + .1
        if level > 1:
            add(f'block{level}.downsample.weight', outputs, inputs, 1, 1)
            add(f'block{level}.downsample.bias', outputs)
        add(f'conv{level}.weight', DIMENSION // 4, outputs, 1, 1)
    add('convhead2.weight', DIMENSION + 1, DIMENSION, 1, 1)
    return weights


def published_network(weights: dict, image: torch.Tensor) -> tuple:
    """Scores and descriptors of a colour image of all pixels: nothing folded, nothing taken apart."""
    def layer(x, block, index):
        x = functional.conv2d(x, weights[f'{block}.conv{index}.weight'], padding=1)
        norm = (weights[f'{block}.bn{index}.{part}'] for part in ('running_mean', 'running_var', 'weight', 'bias'))
        return functional.batch_norm(x, *norm, eps=1e-5)

    size, levels, x = image.shape[2:], [], image
    for level, pooling in enumerate((1, 2, 4, 4), start=1):
        block = f'block{level}'
        x = functional.max_pool2d(x, pooling)
        result = layer(functional.relu(layer(x, block, 1)), block, 2)
        if level > 1:
            result = result + functional.conv2d(x, weights[f'{block}.downsample.weight'],
                                                weights[f'{block}.downsample.bias'])
        x = functional.relu(result)
        reduced = functional.relu(functional.conv2d(x, weights[f'conv{level}.weight']))
        levels.append(functional.interpolate(reduced, size, mode='bilinear', align_corners=True))
    result = functional.conv2d(torch.cat(levels, 1), weights['convhead2.weight'])
    return torch.sigmoid(result[:, -1:]), functional.normalize(result[:, :-1], dim=1)


def grey_image(height: int, width: int) -> np.ndarray:
    """Something to see, in [0, 1]."""
    noise = np.random.default_rng(5).random((height // 8, width // 8), np.float32)
    return cv2.resize(noise, (width, height), interpolation=cv2.INTER_CUBIC).clip(0, 1)


def outputs(model: Path, image: np.ndarray) -> dict:
    """What OpenCV computes, by name."""
    network = cv2.dnn.readNetFromONNX(str(model))
    network.setInput(image[None, None])
    names = network.getUnconnectedOutLayersNames()
    return dict(zip(names, network.forward(names)))


def descriptor(parts: dict, size: tuple, x: int, y: int) -> np.ndarray:
    """That of a pixel, as doc/programs.md says."""
    channels = []
    for name in sorted(name for name in parts if name.startswith('descriptors_')):
        level = parts[name][0]
        x_i, y_i = x * (level.shape[2] - 1) / (size[1] - 1), y * (level.shape[1] - 1) / (size[0] - 1)
        left, top = min(int(x_i), level.shape[2] - 2), min(int(y_i), level.shape[1] - 2)
        across, down = x_i - left, y_i - top
        corners = level[:, top:top + 2, left:left + 2]
        channels.append(corners @ np.array([1 - across, across]) @ np.array([1 - down, down]))
    stacked = np.concatenate(channels)
    result = parts['head'].reshape(-1, len(stacked)) @ stacked
    return result / np.linalg.norm(result)


class ModelTest(unittest.TestCase):
    """Each test has a folder of its own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.model = self.folder / 'made.onnx'

    def export(self, weights: Path) -> str:
        """The script as a program, to its end."""
        result = subprocess.run([sys.executable, str(SCRIPTS / 'export_features.py'), str(weights), '--output',
                                 str(self.model)], capture_output=True, text=True, timeout=200, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def save(self, **changed) -> Path:
        """Weights with some tensors replaced, or left out: None."""
        weights = {**random_weights(), **{name.replace('__', '.'): value for name, value in changed.items()}}
        torch.save({name: value for name, value in weights.items() if value is not None}, self.folder / 'weights.pth')
        return self.folder / 'weights.pth'

    def assert_same(self, weights: dict):
        """The model and the network that it was made of."""
        for size in ((96, 64), (64, 160)):
            image = grey_image(*size)
            with torch.no_grad():
                scores, descriptors = published_network(weights, torch.from_numpy(image).repeat(1, 3, 1, 1))
            parts = outputs(self.model, image)
            self.assertEqual(sorted(parts), [*(f'descriptors_{level}' for level in range(4)), 'head', 'scores'])
            self.assertEqual(parts['scores'].shape, (1, 1, *size))
            self.assertLess(np.abs(parts['scores'] - scores.numpy()).max(), 1e-4)
            for x, y in ((0, 0), (size[1] - 1, size[0] - 1), (17, 30), (40, 33), (63, 5)):
                expected = descriptors[0, :, y, x].numpy()
                self.assertLess(np.abs(descriptor(parts, size, x, y) - expected).max(), 1e-4, (x, y))

    def refused(self, weights: Path, *words: str, output: Path = None):
        """One line, and no model."""
        said = io.StringIO()
        arguments = ['export_features', str(weights), '--output', str(output or self.model)]
        with mock.patch('sys.argv', arguments), contextlib.redirect_stderr(said):
            self.assertEqual(export_features.main(), 1)
        self.assertEqual(len(said.getvalue().splitlines()), 1, said.getvalue())
        for word in words:
            self.assertIn(word, said.getvalue())
        self.assertEqual([path.name for path in self.folder.iterdir() if path.suffix != '.pth'], [])

    def test_the_fast_form_is_the_published_network(self):
        self.assertIn('descriptors of 64 values', self.export(self.save()))
        self.assert_same(random_weights())

    @unittest.skipUnless(PUBLISHED.is_file(), f'{PUBLISHED} is not there')
    def test_so_are_the_published_weights(self):
        self.export(PUBLISHED)
        self.assert_same(torch.load(str(PUBLISHED), map_location='cpu', weights_only=True))

    def test_other_weights_are_named(self):
        nan = torch.full((8,), float('nan'))
        for changed, words in (({'conv3__weight': None}, ('no tensor conv3.weight',)),
                               ({'block2__conv2__weight': torch.zeros(16, 9, 3, 3)},
                                ('block2.conv2.weight has the size 16 x 9 x 3 x 3', 'any x 16 x 3 x 3')),
                               ({'block1__bn1__running_mean': nan}, ('block1.bn1.running_mean', 'not finite')),
                               ({'block1__bn1__running_var': -torch.ones(8)}, ('block1.bn1.running_var', 'below 0')),
                               ({'convhead2__weight': torch.zeros(1, 64, 1, 1)}, ('convhead2.weight has one row',)),
                               ({'convhead1__weight': torch.zeros(64, 64, 1, 1)}, ('second layer', 'ALIKE-t'))):
            self.refused(self.save(**changed), 'weights.pth', *words)

    def test_other_files_are_refused_and_run_no_code(self):
        class Command:
            def __reduce__(self):
                return (Path.touch, (marker,))
        marker = self.folder / 'ran'
        whole = self.save().read_bytes()
        path = self.folder / 'other.pth'
        for content in (b'', b'hello', whole[:len(whole) // 2]):
            path.write_bytes(content)
            self.refused(path, 'other.pth', 'not a file of tensors')
        torch.save({'a': Command()}, path)
        self.refused(path, 'not a file of tensors')
        torch.save([1], path)
        self.refused(path, 'not a dictionary of tensors')
        self.refused(self.folder / 'none.pth', 'none.pth', 'No such file')
        self.refused(self.save(), 'weights.pth/a.onnx: cannot be written', output=self.folder / 'weights.pth' / 'a.onnx')

    def test_the_tiny_model_is_the_one_its_script_makes(self):
        made = self.folder / 'tiny.onnx'
        subprocess.run([sys.executable, str(TEST / 'support' / 'make_tiny_model.py'), str(made)], timeout=100,
                       check=True)
        shipped = TEST / 'data' / 'models' / 'tiny.onnx'
        graphs = [load(str(path)).graph for path in (made, shipped)]
        self.assertEqual(*(graph.node for graph in graphs))
        for mine, theirs in zip(*(graph.initializer for graph in graphs)):
            np.testing.assert_allclose(numpy_helper.to_array(mine), numpy_helper.to_array(theirs), atol=1e-6)

    def test_the_tiny_model_knows_a_place_that_moved_in_the_picture(self):
        image = grey_image(96, 160)
        first, second = (outputs(TEST / 'data' / 'models' / 'tiny.onnx', np.ascontiguousarray(part))
                         for part in (image[:64, :128], image[16:80, 8:136]))
        self.assertLessEqual(first['scores'].max(), 1)
        size = (64, 128)
        pixels = [(x, y) for y in range(8, 56, 8) for x in range(8, 120, 8)]
        for x, y in ((40, 40), (64, 32), (96, 40)):
            place = descriptor(first, size, x, y)
            best = max(pixels, key=lambda pixel, place=place: place @ descriptor(second, size, *pixel))
            self.assertEqual(best, (x - 8, y - 16))


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
