"""The formulas of doc/faults.md, "Memory": resident memory in MiB; and images that claim more than they are."""
import os

BASE, PER_THREAD = 120, 16
LARGEST_PIXELS = 4096 * 4096
SIFT_BYTES, DECODED_BYTES = 140, 8
IMAGE_BYTES, FIX_BYTES = 2 ** 19, 2000
MERGE_CACHE_MIB, MERGED_IMAGE_BYTES = 512, 4000
PAIR_BYTES, STEP_BYTES = 24, 200


# A BLAS with threads of its own (OpenBLAS) adds a stack, a heap and buffers for each core, which are not ours to count.
WITHOUT_THREADS_OF_BLAS = dict(os.environ, OPENBLAS_NUM_THREADS='1')


def mib(count: float) -> float:
    """Bytes in MiB."""
    return count / 2.0 ** 20


def builder_bound(threads: int, pixels: int, images: int, fixes: int) -> float:
    """Of map_builder and `map_edit add`. `pixels`: of the images that are used."""
    return (BASE + threads * (PER_THREAD + mib(SIFT_BYTES * pixels + DECODED_BYTES * LARGEST_PIXELS))
            + mib(IMAGE_BYTES * images + FIX_BYTES * fixes))


def localizer_bound(map_pixels: int, features_mib: float, threads: int = 1) -> float:
    """Of localize, and with its threads of the node. `features_mib`: of the map, in memory."""
    return (BASE + PER_THREAD * threads + 2.0 * features_mib
            + mib(SIFT_BYTES * map_pixels + DECODED_BYTES * LARGEST_PIXELS))


def editor_bound(features_mib: float) -> float:
    """Of map_info and of map_edit without `add` and `merge`."""
    return BASE + PER_THREAD + 2.0 * features_mib


def merge_bound(threads: int, maps_mib: float, images: int) -> float:
    """Of `map_edit merge`. `maps_mib`, `images`: of all maps together."""
    return BASE + PER_THREAD * threads + 2.0 * min(maps_mib, MERGE_CACHE_MIB) + mib(MERGED_IMAGE_BYTES * images)


def evaluate_bound(threads: int, pixels: int, map_images: int, drive_images: int, starts: int) -> float:
    """Of evaluate, with one recording as the map and one as the drive."""
    return (builder_bound(threads, pixels, map_images + drive_images, 0)
            + mib(drive_images * (PAIR_BYTES * map_images + STEP_BYTES * starts)))


def peak_mib(pid: int) -> float:
    """The most resident memory that a running process has had; 0 when it has ended."""
    try:
        with open(f'/proc/{pid}/status', encoding='utf-8') as status:
            return max((float(line.split()[1]) / 1024.0 for line in status if line.startswith('VmHWM')), default=0.0)
    except OSError:
        return 0.0


def with_size(jpeg: bytes, side: int) -> bytes:
    """The baseline JPEG, claiming so many pixels a side."""
    frame = jpeg.index(b'\xff\xc0')
    return jpeg[:frame + 5] + side.to_bytes(2, 'big') * 2 + jpeg[frame + 9:]
