"""Pictures of rooms from random free poses, with what is known of each, for what learns to see.

A room's pictures stand in a file of their own, a shard; `stream.Views` reads a folder of them in shuffled batches.
Nothing here imports PyTorch.
"""
