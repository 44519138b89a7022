"""`clearway scenes import KIND`, a file for each sort of source; docs/scenes.md has a page on each kind."""
