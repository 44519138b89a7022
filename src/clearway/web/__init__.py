"""What every service of ours on this machine shares: who may talk to it, and how it starts and ends."""
