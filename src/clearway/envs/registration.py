"""The environments' ids in Gymnasium's registry."""

from __future__ import annotations

from gymnasium.envs.registration import register, registry

ENV_ID = "Clearway/ImageGoal-v0"
LIVE_ENV_ID = "Clearway/LiveImageGoal-v0"
DEFAULT_STEP_LIMIT = 500
"""Steps after which `gymnasium.make` and `make_vec` cut an episode: the limit of the paper's success score."""


def register_environments() -> None:
    """Enter `ENV_ID` and `LIVE_ENV_ID` in Gymnasium's registry; a second call changes nothing."""
    if ENV_ID not in registry:
        register(
            ENV_ID,
            entry_point="clearway.envs.single:ImageGoalEnv",
            vector_entry_point="clearway.envs.vector:ImageGoalVectorEnv",
            max_episode_steps=DEFAULT_STEP_LIMIT,
        )
    if LIVE_ENV_ID not in registry:
        register(
            LIVE_ENV_ID,
            entry_point="clearway.live_envs.single:LiveImageGoalEnv",
            vector_entry_point="clearway.live_envs.vector:LiveImageGoalVectorEnv",
            max_episode_steps=DEFAULT_STEP_LIMIT,
        )
