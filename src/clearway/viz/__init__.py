"""Pictures of results: maps with trajectories, contact sheets, learning curves, and the demo's page."""
