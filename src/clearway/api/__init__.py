"""What `import clearway` offers, a file each: scenes, environments, training, evaluation. Paths may be strings."""
