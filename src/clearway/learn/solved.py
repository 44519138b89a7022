"""Which targets a run has solved, by its newest checkpoint."""

from __future__ import annotations

from clearway.learn.checkpoint import newest_checkpoint, read_training
from clearway.learn.run_folder import RunFolder

SUCCESS = "statistics.recent_success"  # of the trainers' tensors, see `EpisodeStatistics`


def unsolved_targets(folder: RunFolder) -> dict[str, tuple[int, ...]]:
    """Targets that not all of their latest training episodes reached, or that had too few: state ids by scene name.

    Empty where all are solved, and where the checkpoint does not tell: of another package's algorithm, and of own goals
    in several scenes, among which the given targets cannot be told apart.

    Raises:
        RunError: there is no such run or checkpoint, or it is damaged.
    """
    success = read_training(newest_checkpoint(folder.checkpoints)).get(SUCCESS)
    targets = folder.read_record().targets
    if success is None or (len(targets) > 1 and len(success) != sum(map(len, targets.values()))):
        return {}
    rates = iter(success.tolist())  # in the order of the scenes, in each the given targets first
    unsolved = {
        scene: tuple(state for state, rate in zip(states, rates, strict=False) if rate != 1)
        for scene, states in targets.items()
    }
    return {scene: states for scene, states in unsolved.items() if states}
