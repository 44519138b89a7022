"""Learning: rollouts, returns and losses as pure functions, the synchronous trainer, run folders and checkpoints."""
