"""What several tests share: made-up scenes, small runs, stand-ins."""
