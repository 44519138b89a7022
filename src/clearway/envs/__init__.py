"""Environments: the transition rule in batches (`navigation`), and Gymnasium's single and vector environments on it."""
