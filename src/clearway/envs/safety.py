"""The environment with costs as a value of their own, as Safety-Gymnasium's are (Ji et al., NeurIPS 2023)."""

from __future__ import annotations

from typing import Any

import gymnasium


class SafetyWrapper(gymnasium.Wrapper):
    """Returns six values from `step`: observation, reward, cost, terminated, truncated, info.

    The cost is 1.0 on a blocked move, else 0.0; it stays in `info["cost"]` too. Use it on the environment that
    `gymnasium.make` gives, and hand it to code that expects Safety-Gymnasium's interface, not Gymnasium's.
    """

    def step(self, action: Any) -> tuple[Any, Any, float, bool, bool, dict[str, Any]]:  # type: ignore[override]
        """Move the agent."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, float(info["cost"]), terminated, truncated, info
