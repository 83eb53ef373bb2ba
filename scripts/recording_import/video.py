"""Videos, with the track of a GoPro in them or a GPX file beside them."""
import argparse
import os
import struct
from pathlib import Path
from typing import BinaryIO, Dict, Iterator, List, NamedTuple, Optional, Tuple

import cv2
from evaluation_report.data import DataError

from .recording import Fix, Image, Recording, require_pixels, resized
from .sources import start_ns
from .times import add_gpx, gpx_fixes

SINCE_1904_S = 2082844800
MOST_INDEX_BYTES = 64 << 20
MOST_TRACK_BYTES = 256 << 20


class Track(NamedTuple):
    """What a GoPro's own track says, in seconds of the video."""

    seconds: float
    latitude: float
    longitude: float
    altitude: float


def boxes(data: bytes, begin: int, end: int) -> Iterator[Tuple[bytes, int, int]]:
    """Kind, begin and end of what is in a box of ISO 14496-12."""
    while begin + 8 <= end:
        size, kind = struct.unpack_from('>I4s', data, begin)
        head = 8
        if size == 1:
            size, head = struct.unpack_from('>Q', data, begin + 8)[0], 16
        size = end - begin if size == 0 else size
        if size < head or begin + size > end:
            raise ValueError('a box is longer than what holds it')
        yield kind, begin + head, begin + size
        begin += size


def index_of(file: BinaryIO) -> bytes:
    """The content of the box moov: what an MP4 is made of. Empty without one."""
    while True:
        head = file.read(16)
        if len(head) < 8:
            return b''
        size, kind = struct.unpack_from('>I4s', head)
        length = 8
        if size == 1 and len(head) == 16:
            size, length = struct.unpack_from('>Q', head, 8)[0], 16
        if size < length:
            return b''
        if kind == b'moov':
            if size > MOST_INDEX_BYTES:
                raise ValueError(f'its index has {size} bytes, at most {MOST_INDEX_BYTES} are read')
            file.seek(length - len(head), 1)
            return file.read(size - length)
        file.seek(size - len(head), 1)


def below(data: bytes, begin: int, end: int) -> Dict[bytes, Tuple[int, int]]:
    """The first box of each kind."""
    found: Dict[bytes, Tuple[int, int]] = {}
    for kind, first, last in boxes(data, begin, end):
        found.setdefault(kind, (first, last))
    return found


def numbers(data: bytes, at: int, row: str) -> List[tuple]:
    """A table of a box: version and flags, how many, and the rows."""
    count, size = struct.unpack_from('>I', data, at + 4)[0], struct.calcsize(row)
    return list(struct.iter_unpack(row, data[at + 8:at + 8 + count * size]))


def created_s(data: bytes) -> Optional[int]:
    """Unix time at which the video was made; None when it does not say."""
    place = below(data, 0, len(data)).get(b'mvhd')
    if place is None:
        return None
    seconds = struct.unpack_from('>Q' if data[place[0]] == 1 else '>I', data, place[0] + 4)[0] - SINCE_1904_S
    return seconds if 0 < seconds < 2**32 else None


def samples_of(data: bytes, kind: bytes) -> List[Tuple[int, int, float, float]]:
    """Place, size, time and duration, seconds, of the samples of the first track of a kind."""
    for name, begin, end in boxes(data, 0, len(data)):
        if name != b'trak':
            continue
        media = below(data, *below(data, begin, end)[b'mdia'])
        table = below(data, *below(data, *media[b'minf'])[b'stbl'])
        if data[table[b'stsd'][0] + 12:table[b'stsd'][0] + 16] != kind:
            continue
        head = media[b'mdhd'][0]
        scale = struct.unpack_from('>I', data, head + (20 if data[head] == 1 else 12))[0]
        same, count = struct.unpack_from('>II', data, table[b'stsz'][0] + 4)
        sizes = [same] * min(count, MOST_INDEX_BYTES // 4) if same else [
            row[0] for row in numbers(data, table[b'stsz'][0] + 4, '>I')]
        chunks = [row[0] for row in (numbers(data, table[b'co64'][0], '>Q') if b'co64' in table else
                                     numbers(data, table[b'stco'][0], '>I'))]
        durations = [length for times, length in numbers(data, table[b'stts'][0], '>II')
                     for _ in range(min(times, len(sizes)))]
        groups = numbers(data, table[b'stsc'][0], '>III')
        found, time = [], 0
        for index, place in enumerate(chunks, 1):
            in_chunk = [count for first, count, _ in groups if first <= index][-1]
            for _ in range(min(in_chunk, len(sizes) - len(found))):
                size, length = sizes[len(found)], durations[len(found)]
                found.append((place, size, time / scale, length / scale))
                place, time = place + size, time + length
        return found
    return []


def readings(data: bytes, begin: int, end: int) -> Iterator[Tuple[bytes, bytes, int, bytes]]:
    """Key, type, size of an element and bytes, of GoPro's metadata format, level by level."""
    while begin + 8 <= end:
        key, kind, size, count = struct.unpack_from('>4scBH', data, begin)
        last = begin + 8 + size * count
        if last > end:
            raise ValueError('an entry of its track is longer than what holds it')
        if kind == b'\0':
            yield from readings(data, begin + 8, last)
        else:
            yield key, kind, size, data[begin + 8:last]
        begin = begin + 8 + (size * count + 3) // 4 * 4


def track_of(payload: bytes, time_s: float, duration_s: float) -> List[Track]:
    """The positions of one sample, which lie evenly in its time; none while the receiver has no fix."""
    scale, has_fix, found = [], True, []
    for key, kind, size, value in readings(payload, 0, len(payload)):
        if key == b'SCAL':
            scale = [number for number, in struct.iter_unpack('>i' if kind == b'l' else '>h', value)]
        elif key == b'GPSF':
            has_fix = struct.unpack('>I', value)[0] >= 2
        elif key in (b'GPS5', b'GPS9') and size >= 12 and len(scale) >= 3 and 0 not in scale[:3]:
            rows = [value[at:at + size] for at in range(0, len(value) - size + 1, size)]
            for index, row in enumerate(rows):
                if key == b'GPS9' and size == 32:
                    has_fix = struct.unpack_from('>H', row, 30)[0] >= 2
                place = [number / divisor for number, divisor in zip(struct.unpack_from('>3i', row), scale)]
                if has_fix and abs(place[0]) <= 90 and abs(place[1]) <= 180 and abs(place[2]) <= 1e5:
                    found.append(Track(time_s + duration_s * index / len(rows), *place))
    return found


def own_track(path: Path) -> Tuple[Optional[int], List[Track]]:
    """When an MP4 was made, and where by its own receiver."""
    try:
        with open(path, 'rb') as file:
            index = index_of(file)
            samples = samples_of(index, b'gpmd')
            if sum(size for _, size, _, _ in samples) > MOST_TRACK_BYTES:
                raise ValueError(f'its track has more than {MOST_TRACK_BYTES} bytes')
            track = []
            for place, size, time_s, duration_s in samples:
                file.seek(place)
                track += track_of(file.read(size), time_s, duration_s)
            return created_s(index), track
    except OSError as error:
        raise DataError(path, f'cannot be read: {error.strerror}') from error
    except (KeyError, IndexError, ValueError, struct.error, ZeroDivisionError, RecursionError) as error:
        raise DataError(path, f'is a broken MP4: {error}') from error


def frames_of(path: Path, options: argparse.Namespace) -> List[Tuple[float, Path]]:
    """Seconds and files of the images that are taken from a video, as JPEG."""
    os.environ.setdefault('OPENCV_FFMPEG_LOGLEVEL', '-8')  # nothing of FFmpeg's own on the terminal
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        raise DataError(path, 'is not a video that OpenCV reads')
    require_pixels(path, int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)), int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)),
                   options.width)
    frames, due = [], 0.0
    while capture.grab():
        seconds = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
        if seconds < due:
            continue
        has_frame, pixels = capture.retrieve()
        if not has_frame:
            continue
        due = max(due + float(options.period), seconds)
        file = Path(options.scratch) / f'{len(frames):09d}.jpg'
        if not cv2.imwrite(str(file), resized(pixels, options.width), [cv2.IMWRITE_JPEG_QUALITY, 95]):
            raise DataError(file, 'cannot be written')
        frames.append((seconds, file))
    capture.release()
    if not frames:
        raise DataError(path, 'holds no frame that OpenCV reads')
    return frames


def video(options: argparse.Namespace) -> Recording:
    """A video: positions by its own track (GPMF) or a GPX file."""
    if not options.source.is_file():
        raise DataError(options.source, 'there is no such file')
    created, track = own_track(options.source)
    if options.gpx is None and not track:
        raise DataError(options.source, 'has no track of its own (GPMF) with a fix: --gpx FILE adds one')
    begin, zoned = created, False
    if options.start is not None:
        begin_ns, note, zoned = start_ns(options), 'as told', True
    elif begin is not None:
        begin_ns, note = begin * 10**9, 'by the time at which it says to be made'
    elif options.gpx is not None:
        begin_ns = min(fix.stamp_ns for fix in gpx_fixes(options.gpx, None))
        note = 'guessed: at the first point of the track'
    else:
        begin_ns, note = start_ns(options), 'not known'
    recording = Recording([Image(begin_ns + round(seconds * 1e9), file) for seconds, file in
                           frames_of(options.source, options)], [])
    recording.notes.append(f'times: the video begins at {begin_ns / 1e9:.3f} s, {note}')
    if options.gpx is not None:
        add_gpx(recording, options, zoned)
    else:
        recording.fixes = [Fix(begin_ns + round(at.seconds * 1e9), *at[1:], options.sigma) for at in track]
        recording.notes.append(f'positions: its own track of {len(track)} points')
    return recording
