"""The episodes in progress, kept for rendering: where every agent has been and where it bumped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class EpisodeSoFar:
    """One episode so far.

    Attributes:
        states: (T + 1,) int64, the start and the pose after each of T steps, in the numbering of all scenes.
        bumps: (B, 2) int64, state and action of each blocked move.
    """

    states: np.ndarray
    bumps: np.ndarray


class EpisodeRecord:
    """The episodes in progress of N environments."""

    def __init__(self, env_count: int) -> None:
        self._rows: list[np.ndarray] = []  # one a step: (N, 3) state, action, blocked
        self._dropped = 0  # rows that no episode in progress needs any more
        self._first = np.zeros(env_count, np.int64)  # row of each episode's start, dropped ones counted

    def add(self, state: np.ndarray, action: np.ndarray, blocked: np.ndarray) -> None:
        """Note one step of every environment, each (N,)."""
        self._rows.append(np.stack([state, action, blocked], axis=1).astype(np.int64))

    def begin(self, index: np.ndarray, state: np.ndarray) -> None:
        """Begin episodes in the environments in index (B,), at state (N,); it takes the place of their last step."""
        if not self._rows:
            self.add(state, np.zeros_like(state), np.zeros_like(state))
        self._rows[-1][index] = 0
        self._rows[-1][index, 0] = state[index]
        self._first[index] = self._dropped + len(self._rows) - 1
        unused = int(self._first.min()) - self._dropped
        del self._rows[:unused]
        self._dropped += unused

    def episode(self, env: int) -> EpisodeSoFar:
        """The episode in progress of one environment."""
        rows = np.stack([row[env] for row in self._rows[self._first[env] - self._dropped :]])
        return EpisodeSoFar(rows[:, 0], rows[rows[:, 2] == 1, :2])
