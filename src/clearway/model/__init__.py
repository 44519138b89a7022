"""The siamese actor-critic: `network` defines it, `lookup` computes it from tables with hand-written gradients."""
