"""Environments: the transition rule in batches (`navigation`), and Gymnasium's single and vector environments on it.

Importing this package registers `Clearway/ImageGoal-v0` with Gymnasium; PyTorch is loaded when one is made.
"""

from clearway.envs.registration import register_environments

register_environments()
