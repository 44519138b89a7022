"""Pretraining of the eyes (`perception.eyes`) on views of many rooms: what they are taught, how, and how well they see.

`labels` (what is true of two pictures), `augment` (light and noise), `losses`, `pretrain` (the loop, its checkpoints),
`judge` (measures in rooms that no training has seen).
"""
