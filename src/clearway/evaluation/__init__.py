"""Evaluation by the paper's protocol: policies walk batched episodes; metrics, intervals, tables."""
