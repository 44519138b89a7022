"""Very many scene files read once: their features unpacked into one file that all processes of this machine map."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from clearway.files import cache_dir, part_folder
from clearway.scenes.features import FileFeatures
from clearway.scenes.mapped_features import FLOAT_BYTES, MappedFeatures, written_features
from clearway.scenes.scene import Scene
from clearway.spread.many import of_each
from clearway.world.feature_store import check_together, reserve, room_for


@contextmanager
def mapped_scenes(scenes: Sequence[Scene]) -> Iterator[tuple[list[Scene], list[str]]]:
    """The scenes with features in one mapped file, and the digest of each, see `scene_digest`.

    The file is gone afterwards; who has mapped it meanwhile keeps what it holds.

    Args:
        scenes: one at least, with features in their files (`FileFeatures`).

    Raises:
        SceneError: features do not belong together, or a file is damaged or has changed.
        RunError: there is no room for the features.
    """
    check_together(scenes)
    with part_folder(cache_dir() / "mapped") as folder:
        path, first, features = folder / "features", 0, []
        for scene in scenes:
            assert isinstance(scene.features, FileFeatures)
            features.append(MappedFeatures(path, first, scene.features.shape))
            first += scene.state_count
        count = features[0].shape[1]
        with room_for(first, count, "mapped"), path.open("xb") as file:
            reserve(file, first * count * FLOAT_BYTES)
        slim = [scene.without_pictures() for scene in scenes]
        digests = list(of_each(written_features, list(zip(slim, features, strict=True))))
        yield [scene.with_features(own, scene.encoder) for scene, own in zip(slim, features, strict=True)], digests
