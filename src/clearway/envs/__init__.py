"""Gymnasium's single and vector environments, on the transition rule in batches (`world.navigation`).

Importing this package registers `Clearway/ImageGoal-v0` with Gymnasium; PyTorch is loaded when one is made.
"""

from clearway.envs.registration import register_environments

register_environments()
